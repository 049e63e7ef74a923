// SPDX-License-Identifier: Apache-2.0
#include "prove/generator/subject.hpp"

#include <algorithm>
#include <cmath>

namespace ravencal::prove {

using Eigen::Index;

const SubjectKind* kind_of(std::string_view id) {
  for (const auto& kinds : {vocabulary_kinds(), outside_kinds()})
    for (const SubjectKind& kind : kinds)
      if (kind.id == id) return &kind;
  return nullptr;
}

std::vector<MotionFigures> motion_figures(const NominalRobot& robot, MotionKind motion,
                                          double duration_s, std::uint64_t motion_seed) {
  constexpr double kStep = 0.02;
  const Chain chain = chain_of(robot);
  std::vector<Path> paths;
  for (const NominalJoint& joint : robot.joints)
    paths.emplace_back(joint.range, motion, duration_s + 1.0, Random(motion_seed, joint.name));
  const auto rows = static_cast<Index>(duration_s / kStep);
  Eigen::MatrixXd q = Eigen::MatrixXd::Zero(rows, 3), weight = q;
  for (Index r = 0; r < rows; ++r) {
    for (std::size_t j = 0; j < paths.size(); ++j)
      q(r, static_cast<Index>(j)) = paths[j].at(static_cast<double>(r) * kStep);
    weight.row(r) = chain.weight(q.row(r).transpose()).transpose();
  }
  std::vector<MotionFigures> figures(paths.size());
  for (std::size_t j = 0; j < paths.size(); ++j) {
    const auto c = static_cast<Index>(j);
    MotionFigures& f = figures[j];
    const Eigen::VectorXd v = (q.col(c).tail(rows - 1) - q.col(c).head(rows - 1)) / kStep;
    const Eigen::VectorXd a = (v.tail(rows - 2) - v.head(rows - 2)) / kStep;
    const auto rms = [](const auto& x) {
      return std::sqrt(x.squaredNorm() / static_cast<double>(x.size()));
    };
    f.position_rms = rms(q.col(c));
    f.velocity_rms = rms(v);
    f.acceleration_rms = rms(a);
    f.travel = v.cwiseAbs().sum() * kStep;
    f.span = q.col(c).maxCoeff() - q.col(c).minCoeff();
    f.centre = q.col(c).mean();
    f.weight_rms = rms(weight.col(c));
    f.weight_most = weight.col(c).cwiseAbs().maxCoeff();
    f.weight_span = weight.col(c).maxCoeff() - weight.col(c).minCoeff();
    double last = 0.0;
    for (Index r = 0; r + 1 < rows; ++r) {
      if (v[r] * last < 0.0) f.reversals += 1.0;
      if (v[r] != 0.0) last = v[r];
    }
  }
  return figures;
}

void any_joint(Subject& subject, std::size_t joints, Random& random) {
  subject.joint = random.below(joints);
}

void joint_after_another(Subject& subject, std::size_t joints, Random& random) {
  subject.joint = 1 + random.below(joints - 1);
  subject.from = random.below(subject.joint);
}

Subject draw_subject(const SubjectKind& kind, const NominalRobot& robot,
                     const std::vector<MotionFigures>& figures, double duration_s, Random& random) {
  Subject s;
  s.kind = &kind;
  kind.choose(s, robot.joints.size(), random);
  const MotionFigures& f = figures[s.joint];
  s.details["phase_rad"] = random.uniform(0.0, 6.28);
  const double place = f.centre + f.span * random.uniform(-0.2, 0.2);
  const double at_s = duration_s * random.uniform(0.3, 0.7);
  const double width = f.span * random.uniform(0.06, 0.12);
  s.details["sign"] = random.sign();
  const double share = random.uniform();
  if (kind.draw != nullptr)
    kind.draw({{s, robot, figures}, s, s.details, duration_s, place, width, at_s, share, random});
  return s;
}

double amplitude_for(const Subject& s, const NominalRobot& robot,
                     const std::vector<MotionFigures>& figures, double rms) {
  const SubjectKind& kind = *s.kind;
  const Setting at{s, robot, figures};
  const double amplitude = kind.amplitude != nullptr  ? kind.amplitude(at, rms)
                           : kind.unit_rms != nullptr ? rms / kind.unit_rms(at)
                                                      : rms;
  return std::min(amplitude, at.joint.prismatic ? kind.most.prismatic : kind.most.rotary);
}

double reported_value(const Subject& s) {
  const double size = s.kind->is(kSigned) ? s.details.at("sign") * s.amplitude : s.amplitude;
  return s.kind->is(kFactor) ? 1.0 + size : size;
}

void conceal(const Subject& subject, NominalRobot& nominal) {
  const SubjectKind& kind = *subject.kind;
  NominalJoint& joint = nominal.joints[subject.joint];
  if (kind.conceal != nullptr) kind.conceal(joint);
  if (kind.stated[0].value != nullptr) joint.*kind.stated[0].value = 0.0;
}

void apply(const Subject& s, double amplitude, Session& session) {
  if (amplitude == 0.0) return;
  s.kind->apply({s, amplitude, s.details.at("sign") * amplitude, session});
}

}  // namespace ravencal::prove
