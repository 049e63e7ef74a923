// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/term_library.hpp"

#include <algorithm>
#include <cmath>

namespace ravencal::prove {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using record::Role;

constexpr Index kMostRows = 6000;

VectorXd smoothed(const VectorXd& x, Index half) {
  VectorXd out(x.size());
  double sum = 0.0;
  Index a = 0, b = 0;
  for (Index i = 0; i < x.size(); ++i) {
    for (; b < std::min(x.size(), i + half + 1); ++b) sum += x[b];
    for (; a < i - half; ++a) sum -= x[a];
    out[i] = sum / static_cast<double>(b - a);
  }
  return out;
}

VectorXd slope(const VectorXd& x, const VectorXd& t_s) {
  VectorXd out = VectorXd::Zero(x.size());
  for (Index i = 1; i + 1 < x.size(); ++i)
    out[i] = (x[i + 1] - x[i - 1]) / (t_s[i + 1] - t_s[i - 1]);
  return out;
}

/// -1 to 1: which side of a gap of that width the position pushes.
VectorXd play(const VectorXd& q, double width) {
  VectorXd out(q.size());
  double side = 0.0;
  for (Index i = 0; i < q.size(); ++i) {
    if (i > 0) side = std::clamp(side + 2.0 * (q[i] - q[i - 1]) / width, -1.0, 1.0);
    out[i] = side;
  }
  return out;
}

MatrixXd wave(const VectorXd& q, double order) {
  MatrixXd out(q.size(), 2);
  out.col(0) = (order * q.array()).sin();
  out.col(1) = (order * q.array()).cos();
  return out;
}

MatrixXd together(const std::vector<VectorXd>& columns, Index rows) {
  MatrixXd out(rows, static_cast<Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) out.col(static_cast<Index>(c)) = columns[c];
  return out;
}

double narrow(const NominalJoint& j) { return j.prismatic ? 3e-5 : 6e-4; }

}  // namespace

Signals signals_of(const record::Recording& r, const NominalRobot& plant, std::size_t joint) {
  const NominalJoint& j = plant.joints[joint];
  const Chain chain = chain_of(plant);
  VectorXd t_s(r.rows());
  for (Index i = 0; i < r.rows(); ++i)
    t_s[i] = static_cast<double>(r.t_ns[static_cast<std::size_t>(i)]) * 1e-9;
  const auto half = static_cast<Index>(0.1 * plant.row_rate_hz);
  std::vector<VectorXd> positions;
  for (const NominalJoint& each : plant.joints)
    positions.push_back(smoothed(r.samples.col(*r.column(Role::kJointEstimate, each.name)), half));
  const VectorXd v = smoothed(slope(positions[joint], t_s), half);
  const VectorXd a = smoothed(slope(v, t_s), half);
  const auto truth = r.column(Role::kJointTruth, j.name);
  const auto torque = r.column(Role::kDriveTorque, j.name);
  const VectorXd effort =
      torque ? smoothed(r.samples.col(*torque) * (j.reduction / j.gearbox_ratio), half)
             : VectorXd();
  const Index stride = std::max<Index>(1, r.rows() / kMostRows);
  std::vector<Index> rows;
  for (Index i = stride; i + stride < r.rows(); i += stride)
    if (!truth || std::isfinite(r.samples(i, *truth))) rows.push_back(i);
  Signals s;
  s.t_s = t_s(rows);
  s.q = positions[joint](rows);
  s.v = v(rows);
  s.a = a(rows);
  s.side = play(s.q, narrow(j));
  if (truth) s.truth = r.samples.col(*truth)(rows);
  if (torque) s.effort = effort(rows);
  s.weight.resize(s.rows());
  for (Index i = 0; i < s.rows(); ++i) {
    Vector3d q = Vector3d::Zero();
    for (std::size_t k = 0; k < positions.size(); ++k)
      q[static_cast<Index>(k)] = positions[k][rows[static_cast<std::size_t>(i)]];
    s.weight[i] = chain.weight(q)[static_cast<Index>(joint)];
  }
  for (std::size_t k = 0; k < positions.size(); ++k)
    s.others.push_back(k == joint ? VectorXd(VectorXd::Zero(s.rows()))
                                  : VectorXd(positions[k](rows)));
  return s;
}

TermLibrary position_library(const Signals& s, const NominalRobot& plant, std::size_t joint) {
  const NominalJoint& j = plant.joints[joint];
  TermLibrary lib;
  lib.y = s.truth - s.q + plant.truth_latency_s * s.v;
  lib.smallest = 0.5 * typical_floor(j.prismatic, false);
  std::vector<VectorXd> nuisance;
  if (j.stiffness > 0.0) {
    lib.y += (s.weight + j.joint_friction * s.side) / j.stiffness;
    nuisance = {s.weight / j.stiffness};
    if (j.joint_friction > 0.0) nuisance.push_back(s.side * (j.joint_friction / j.stiffness));
  }
  lib.nuisance = together(nuisance, s.rows());
  const auto add = [&](const char* id, const MatrixXd& columns) {
    lib.groups.push_back({id, columns});
  };
  const VectorXd t = s.t_s.array() - s.t_s[0];
  const double whole_s = t[t.size() - 1];
  add("homing_offset", VectorXd::Ones(s.rows()));
  add("gain_error", s.q);
  for (std::size_t k = 0; k < s.others.size(); ++k)
    if (k != joint) add("coupling", s.others[k]);
  if (j.stiffness <= 0.0) add("compliance", s.weight);
  add("backlash", s.weight.array().sign().matrix());
  if (j.joint_friction <= 0.0) add("joint_friction", play(s.q, 4.0 * narrow(j)));
  add("hysteresis", play(s.q, 40.0 * narrow(j)));
  VectorXd slow(s.rows());
  double state = s.weight[0];
  for (Index i = 0; i < s.rows(); ++i) {
    if (i > 0) state += (s.weight[i] - state) * std::min(1.0, (t[i] - t[i - 1]) / 10.0);
    slow[i] = state;
  }
  add("creep", slow - s.weight);
  add("eccentricity", wave(s.q, j.reduction / j.gearbox_ratio));
  for (const double share : {0.35, 0.45, 0.55, 0.65}) {
    add("slip", (t.array() > share * whole_s).cast<double>().matrix());
  }
  add("delay", s.v);
  add("thermal_drift", (1.0 - (-3.0 * t.array() / whole_s).exp()).matrix());
  return lib;
}

TermLibrary drive_library(const Signals& s, const NominalRobot& plant, std::size_t joint) {
  const NominalJoint& j = plant.joints[joint];
  TermLibrary lib;
  lib.smallest = 0.5 * typical_floor(j.prismatic, true);
  const double inertia = j.motor_inertia_kg_m2 * j.reduction * j.reduction + j.inertia_kg_m2[2];
  const double known_dry = j.coulomb + j.joint_friction;
  const VectorXd known = inertia * s.a + s.weight + known_dry * s.side + j.viscous * s.v;
  lib.y = s.effort - known;
  std::vector<VectorXd> nuisance = {s.a};
  if (j.mass_kg > 0.0) nuisance.push_back(s.weight);
  if (known_dry > 0.0) nuisance.push_back(s.side);
  if (j.viscous > 0.0) nuisance.push_back(s.v);
  lib.nuisance = together(nuisance, s.rows());
  const auto add = [&](const char* id, const MatrixXd& columns) {
    lib.groups.push_back({id, columns});
  };
  if (j.coulomb <= 0.0) add("coulomb_friction", s.side);
  if (j.viscous <= 0.0) add("viscous_friction", s.v);
  const VectorXd ratio = s.v / (3.0 * j.stribeck_velocity);
  if (j.stribeck_extra <= 0.0)
    add("stribeck_friction", s.side.array() * (-ratio.array().square()).exp());
  if (j.presliding <= 0.0) add("presliding", play(s.q, 10.0 * narrow(j)) - s.side);
  add("asymmetric_friction", s.side.cwiseAbs());
  add("load_dependent_friction", s.side.cwiseProduct(s.weight.cwiseAbs()));
  add("torque_constant", known);
  add("torque_ripple", wave(s.q, 2.0 * j.reduction / j.gearbox_ratio));
  if (j.mass_kg <= 0.0) add("gravity", wave(s.q, 1.0));
  return lib;
}

}  // namespace ravencal::prove
