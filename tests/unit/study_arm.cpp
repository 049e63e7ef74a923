// SPDX-License-Identifier: Apache-2.0
#include "unit/study_arm.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cmath>

#include "core/catalogue.hpp"
#include "core/joint_layout.hpp"
#include "core/random.hpp"
#include "record/recording_writer.hpp"

namespace ravencal::study {
namespace {

namespace fs = std::filesystem;

record::Channel channel_of(const core::CatalogueEntry& entry) {
  record::Channel channel{entry.name, entry.si_unit, record::Role::kFeature, ""};
  const bool calibrated = !entry.other_arm && entry.joint_slot < core::kCalibratedJointCount;
  if (calibrated && entry.field == core::RavenField::kJpos) {
    channel.role = record::Role::kJointEstimate;
    channel.joint = core::kSlotNames[entry.joint_slot];
  }
  return channel;
}

}  // namespace

record::Recording study_arm(int rows, unsigned seed, double encoder_shift) {
  record::Recording arm;
  arm.source = "study_arm";
  const auto catalogue = core::catalogue();
  for (const core::CatalogueEntry& entry : catalogue) arm.channels.push_back(channel_of(entry));
  for (std::size_t joint = 0; joint < core::kCalibratedJointCount; ++joint) {
    const std::string name(core::kSlotNames[joint]);
    arm.channels.push_back(
        {"truth." + name, std::string(core::kSlotUnits[joint]), record::Role::kJointTruth, name});
  }
  arm.samples.resize(rows, static_cast<Eigen::Index>(arm.channels.size()));
  core::Random random(seed);
  const double phase = 6.0 * random.uniform();
  for (int row = 0; row < rows; ++row) {
    arm.t_ns.push_back(row * 10'000'000LL);
    for (std::size_t c = 0; c < catalogue.size(); ++c) {
      const core::CatalogueEntry& entry = catalogue[c];
      const double slot = static_cast<double>(entry.joint_slot);
      double value = std::sin(0.013 * row * (1.0 + 0.3 * slot) + phase + 0.5 * slot);
      // Independent torques, so that they hold information that no pose has; all else follows the
      // pose.
      if (entry.group == core::FeatureGroup::kTorque || entry.group == core::FeatureGroup::kCurrent)
        value = std::sin(0.031 * row * (1.0 + 0.2 * slot) + 2.0 * phase);
      if (entry.field == core::RavenField::kEncVals) value = 1000.0 * value + encoder_shift;
      if (entry.other_arm || entry.field == core::RavenField::kEncOffsets) value = 1.0;
      arm.samples(row, static_cast<Eigen::Index>(c)) = value;
    }
    for (std::size_t joint = 0; joint < core::kCalibratedJointCount; ++joint) {
      const auto at = [&](core::RavenField field) {
        return arm.samples(row, static_cast<Eigen::Index>(core::catalogue_index(field, joint)));
      };
      const double jpos = at(core::RavenField::kJpos);
      const double error =
          0.02 + 0.03 * jpos + 0.05 * at(core::RavenField::kTau) + 0.002 * (random.uniform() - 0.5);
      arm.samples(row, static_cast<Eigen::Index>(catalogue.size() + joint)) = jpos + error;
    }
  }
  return arm;
}

StudyFolder::StudyFolder() {
  static std::atomic<int> folders{0};
  path_ = fs::temp_directory_path() /
          ("ravencal_study_" + std::to_string(::getpid()) + "_" + std::to_string(folders++));
  fs::create_directories(path_);
}

StudyFolder::~StudyFolder() { fs::remove_all(path_); }

std::string StudyFolder::recording(const std::string& name, int rows, unsigned seed) const {
  const fs::path path = path_ / name;
  const core::Status status = record::write_recording(study_arm(rows, seed), path, true);
  EXPECT_TRUE(status.ok());
  return path.string();
}

}  // namespace ravencal::study
