// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/term_library.hpp"

#include <algorithm>
#include <cmath>

#include "prove/generator/subject.hpp"

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

MatrixXd together(const std::vector<VectorXd>& columns, Index rows) {
  MatrixXd out(rows, static_cast<Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) out.col(static_cast<Index>(c)) = columns[c];
  return out;
}

void add_groups(const Signals& s, const NominalJoint& joint, std::size_t number,
                const VectorXd& known, bool in_truth, TermLibrary& library) {
  for (const SubjectKind& kind : vocabulary_kinds()) {
    if (kind.terms == nullptr || kind.stage.in_truth != in_truth || kind.stated_by(joint)) continue;
    Terms terms{s, joint, number, known};
    kind.terms(terms);
    for (MatrixXd& columns : terms.added)
      library.groups.push_back({std::string(kind.id), std::move(columns)});
  }
}

}  // namespace

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

double narrow(const NominalJoint& joint) { return joint.prismatic ? 3e-5 : 6e-4; }

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
  add_groups(s, j, joint, {}, true, lib);
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
  add_groups(s, j, joint, known, false, lib);
  return lib;
}

}  // namespace ravencal::prove
