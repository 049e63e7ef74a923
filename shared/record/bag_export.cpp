// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <vector>

#include "core/catalogue.hpp"
#include "core/joint_layout.hpp"
#include "core/units.hpp"
#include "record/bag_file.hpp"
#include "record/bag_load.hpp"
#include "record/profile_builtin.hpp"
#include "record/wall_origin.hpp"

namespace ravencal::record {
namespace {

constexpr std::size_t kTime = core::catalogue_index(core::RavenField::kTime, 0);

bool is_whole_number(core::RavenField field) {
  using core::RavenField;
  switch (field) {
    case RavenField::kRunlevel:
    case RavenField::kSublevel:
    case RavenField::kLastSeq:
    case RavenField::kType:
    case RavenField::kPos:
    case RavenField::kPosD:
    case RavenField::kEncVals:
    case RavenField::kDac:
      return true;
    default:
      return false;
  }
}

class BagExporter {
 public:
  BagExporter(const Recording& recording, const Profile& profile)
      : recording_(recording), profile_(profile), origin_ns_(wall_origin_ns(recording)) {}

  core::Status plan() {
    for (const core::CatalogueEntry& entry : core::catalogue()) {
      const auto column = recording_.column(entry.name);
      if (!column && entry.field != core::RavenField::kTime) {
        return failed(
            fmt::format("no channel {}, which profile {} needs", entry.name, profile_.name));
      }
      columns_.push_back(column.value_or(0));
      to_si_.push_back(core::find_unit(entry.message_unit)->to_si);
    }
    for (std::size_t j = 0; j < core::kCalibratedJointCount; ++j) {
      const auto truth = recording_.column(Role::kJointTruth, core::kSlotNames[j]);
      if (truth) truth_.push_back(*truth);
    }
    if (!truth_.empty() && truth_.size() != core::kCalibratedJointCount)
      return failed("has a truth for some of joints 1 to 3 only; ext_jpos speaks of all three");
    return {};
  }

  core::Status write(const std::filesystem::path& path) {
    RAVENCAL_ASSIGN_OR_RETURN(BagWriter bag, BagWriter::create(path));
    std::int64_t last_ns = 0;
    for (Eigen::Index row = 0; row < recording_.rows(); ++row) {
      const std::int64_t t_ns = recording_.t_ns[static_cast<std::size_t>(row)] + origin_ns_;
      if (t_ns < 0) return failed(fmt::format("row {}: a bag has no time before 1970", row + 1));
      RavenStateMessage state;
      state.stamp_ns = t_ns;
      state.dt_ns = row == 0 ? 0 : t_ns - last_ns;
      RAVENCAL_RETURN_IF_ERROR(fill(state, row));
      RAVENCAL_RETURN_IF_ERROR(bag.write("/" + std::string(kStateTopic), raven_state_type(), t_ns,
                                         encode_raven_state(state, profile_.arm == "gold")));
      if (!truth_.empty()) RAVENCAL_RETURN_IF_ERROR(write_truth(bag, t_ns, row));
      last_ns = t_ns;
    }
    return bag.close();
  }

 private:
  [[nodiscard]] core::Error failed(std::string_view why) const {
    return {core::ErrorCode::kData, fmt::format("{}: {}", recording_.source, why)};
  }

  core::Status fill(RavenStateMessage& state, Eigen::Index row) const {
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      if (i == kTime) continue;
      const double value = recording_.samples(row, columns_[i]) / to_si_[i];
      const core::CatalogueEntry& entry = core::catalogue()[i];
      if (std::isnan(value) && is_whole_number(entry.field)) {
        return failed(fmt::format("row {}: {} is lost, and the message has no way to say so",
                                  row + 1, entry.name));
      }
      state.values[i] = value;
    }
    return {};
  }

  core::Status write_truth(BagWriter& bag, std::int64_t t_ns, Eigen::Index row) const {
    JointStateMessage truth;
    truth.stamp_ns = t_ns;
    for (std::size_t j = 0; j < truth_.size(); ++j) {
      truth.names.emplace_back(core::kSlotNames[j]);
      truth.positions.push_back(recording_.samples(row, truth_[j]));
    }
    return bag.write("/" + std::string(kTruthTopic), joint_state_type(), t_ns,
                     encode_joint_state(truth));
  }

  const Recording& recording_;
  const Profile& profile_;
  std::int64_t origin_ns_;
  std::vector<Eigen::Index> columns_;  // by catalogue index
  std::vector<double> to_si_;
  std::vector<Eigen::Index> truth_;
};

}  // namespace

core::Status export_bag(const Recording& recording, const Profile& profile,
                        const std::filesystem::path& path) {
  BagExporter exporter(recording, profile);
  RAVENCAL_RETURN_IF_ERROR(exporter.plan());
  return exporter.write(path);
}

}  // namespace ravencal::record
