// SPDX-License-Identifier: Apache-2.0
//
// A constant effort of the drive, another one in each recording: a bias of the torque or current
// sensor, or of the amplifier. What all recordings share is the fit's constant, which nothing tells
// from friction that differs between the directions.
#include <fmt/format.h>

#include <algorithm>

#include "diagnose/effects/effects.hpp"
#include "diagnose/effects/nominal_builder.hpp"
#include "diagnose/effects/shapes.hpp"

namespace ravencal::diagnose {
namespace {

/// Recordings that fits see, by index, rising.
std::vector<int> fitted_recordings(const Series& s) {
  std::vector<int> found;
  for (Eigen::Index i = 0; i < s.rows(); ++i) {
    const int recording = s.recording[static_cast<std::size_t>(i)];
    if (s.trains(i) && (found.empty() || found.back() != recording)) found.push_back(recording);
  }
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

class EffortOffset final : public EffectForm {
 public:
  explicit EffortOffset(const EffectKind& kind) : EffectForm(kind) {}
  std::string untestable(const Series& s) const override {
    const std::size_t count = fitted_recordings(s).size();
    if (count < 2)
      return "in one recording a constant effort looks like dry friction that differs between the "
             "directions";
    // Three and more are held out whole (fit/blocks.cpp).
    if (count > 2)
      return "each of more than two recordings is judged by what the others say, and none tells "
             "another's constant: give two at a time";
    return {};
  }
  bool time_only() const override { return true; }
  /// One per recording after the first, each less the first: the recordings' mean stays with the
  /// fit's constant, and so does a held-out recording, whose own constant nobody knows.
  Eigen::MatrixXd columns(const Series& s, const Shape&) const override {
    const std::vector<int> recordings = fitted_recordings(s);
    const auto count = static_cast<Eigen::Index>(recordings.size());
    Eigen::MatrixXd out = Eigen::MatrixXd::Zero(s.rows(), std::max<Eigen::Index>(0, count - 1));
    for (Eigen::Index i = 0; i < s.rows(); ++i) {
      const int own = s.recording[static_cast<std::size_t>(i)];
      const auto place = std::find(recordings.begin(), recordings.end(), own) - recordings.begin();
      if (place == 0) out.row(i).setConstant(-1.0);
      if (place > 0 && place < count) out(i, place - 1) = 1.0;
    }
    return out;
  }
  std::vector<FormParameter> parameters(const Series& s, const Shape&,
                                        const Eigen::VectorXd& b) const override {
    std::vector<FormParameter> offsets = {{"offset_recording_1", -b.sum(), effort_unit(s)}};
    for (Eigen::Index k = 0; k < b.size(); ++k)
      offsets.push_back({fmt::format("offset_recording_{}", k + 2), b[k], effort_unit(s)});
    return offsets;
  }
  std::size_t sizes(const Series& s) const override { return fitted_recordings(s).size(); }
  std::string separate_by() const override {
    return "record the drive at rest with the motor off, or the same motion in a second recording";
  }
};

class EffortOffsetKind final : public EffectKind {
 public:
  EffortOffsetKind() : EffectKind("effort_offset", Stage::kDrive, {.abscissa = Abscissa::kTime}) {}
  void add_forms(const FormContext& context, Forms& forms) const override {
    if (context.series.stage == Stage::kDrive)
      forms.push_back(std::make_unique<EffortOffset>(*this));
  }
  /// The offset is part of the effort asked, which a wrong torque constant does not scale.
  void predict(NominalBuilder& builder) const override {
    const Series& s = builder.series();
    if (!builder.in(Stage::kDrive)) return;
    const double gain = 1.0 + builder.joint().parameter("torque_constant", "ratio");
    builder.linear(*this, "offset", effort_unit(s), builder.parameter(*this, "offset"),
                   Eigen::VectorXd::Constant(s.rows(), gain));
  }
  // No plant_values: offsets that differ between recordings have no place in a plant.
};

}  // namespace

const EffectKind& effort_offset_kind() {
  static const EffortOffsetKind kind;
  return kind;
}

}  // namespace ravencal::diagnose
