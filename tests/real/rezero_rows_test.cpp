// SPDX-License-Identifier: Apache-2.0
//
// One known pose per recording of another day of a real tool: what its constant leaves of the
// corrected error, and what `rezero` says to it. The rows of FIGURES.md.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numeric>
#include <string>
#include <vector>

#include "choice/choose.hpp"
#include "model/homing_constants.hpp"
#include "model/hook_view.hpp"
#include "record/load.hpp"
#include "rezero/constant.hpp"

namespace ravencal {
namespace {

namespace fs = std::filesystem;

const fs::path kTool = fs::path(RAVENCAL_DATA_DIR) / "davinci_tool4";
constexpr double kDeg = 3.14159265358979323846 / 180.0;
/// At 1 kHz: the reading of 50 ms, and a stroke to and fro of 2 s.
constexpr std::ptrdiff_t kReadingRows = 50;
constexpr std::ptrdiff_t kStrokeRows = 2000;

record::Recording loaded(const fs::path& file) {
  record::LoadOptions options;
  options.profile = RAVENCAL_SOURCE_DIR "/tools/profiles/davinci_tool4.toml";
  auto recording = record::load_recording(file, options);
  EXPECT_TRUE(recording.ok()) << recording.error().message;
  return std::move(recording).value();
}

/// Files of that folder whose names begin so, in order.
std::vector<fs::path> files_of(const std::string& beginning) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(kTool)) {
    if (entry.path().filename().string().starts_with(beginning)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

double rms(const std::vector<double>& values, double shift) {
  double squares = 0.0;
  for (const double value : values) squares += (value - shift) * (value - shift);
  return std::sqrt(squares / static_cast<double>(values.size()));
}

double mean(std::vector<double>::const_iterator begin, std::vector<double>::const_iterator end) {
  return std::accumulate(begin, end, 0.0) / static_cast<double>(end - begin);
}

TEST(RezeroRows, OnePoseOfEachLaterRecordingOfARealTool) {
  if (!fs::exists(kTool)) GTEST_SKIP() << "no recordings at " << kTool << " (RAVENCAL_DATA_DIR)";
  std::vector<record::Recording> training;
  for (const fs::path& file : files_of("train_")) training.push_back(loaded(file));
  const auto choice = choice::choose_model(pointers_to(training), {},
                                           [](double, const std::string&) { return true; });
  ASSERT_TRUE(choice.ok()) << choice.error().message;
  const model::CalibrationModel& model = choice->model;
  const double of_pose = model.expected[0].about_mean;
  const std::vector<fs::path> later = files_of("later_");
  ASSERT_EQ(later.size(), 2U);
  for (const fs::path& file : later) {
    const record::Recording recording = loaded(file);
    const auto features = model::inputs_of(model, recording);
    ASSERT_TRUE(features.ok()) << features.error().message;
    const Eigen::MatrixXd predicted = model.predict(features->cast<double>());
    const auto estimate = *recording.column(model.outputs[0].estimate_channel);
    const auto truth_column = *recording.column(record::Role::kJointTruth, model.outputs[0].joint);
    std::vector<double> errors;  // truth - reading - predicted: what a pose at this row tells
    std::vector<double> truth;
    for (Eigen::Index row = 0; row < recording.rows(); ++row) {
      const double value = recording.samples(row, truth_column);
      if (!std::isfinite(value) || !features->row(row).allFinite()) continue;
      truth.push_back(value);
      errors.push_back(value - recording.samples(row, estimate) - predicted(row, 0));
    }
    // A hard stop: where the jaw of the first stroke turns.
    const auto stop = std::max_element(truth.begin(), truth.begin() + kStrokeRows) - truth.begin();
    const auto begin = std::max<std::ptrdiff_t>(stop - kReadingRows / 2, 0);
    const double constant = mean(errors.cbegin() + begin, errors.cbegin() + begin + kReadingRows);
    const double before = rms(errors, 0.0);
    const double about_mean = rms(errors, mean(errors.cbegin(), errors.cend()));
    const double after = rms(errors, constant);
    std::printf("%s: before %.3f, after %.3f, about the mean %.3f, of the pose %.3f deg\n",
                file.filename().c_str(), before / kDeg, after / kDeg, about_mean / kDeg,
                of_pose / kDeg);

    const rezero::Reading reading{
        "later", {{"jaw", "rad", 0.0, 0.0, -constant}}, 1.0, rezero::Homing{}, {}};
    const std::vector<rezero::KnownJoint> pose = {{"jaw", 0.0, 0.1 * kDeg}};
    const auto seen = model::homing_constants_of(model);
    ASSERT_TRUE(seen.ok()) << seen.error().message;
    EXPECT_FALSE(rezero::judge(reading, pose, seen.value(), {}).refusals.empty())
        << "the training is one session: nobody knows what another leaves";
    const std::vector<rezero::JointValue> at_most = {{"jaw", 1.0 * kDeg}};
    const bool is_taken = rezero::judge(reading, pose, seen.value(), at_most).refusals.empty();
    // What has shifted in the rig is no constant at the smaller load: one pose there makes it
    // worse.
    EXPECT_EQ(is_taken, after <= 1.1 * about_mean + of_pose) << file;
  }
}

}  // namespace
}  // namespace ravencal
