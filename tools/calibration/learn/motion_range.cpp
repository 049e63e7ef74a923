// SPDX-License-Identifier: Apache-2.0
#include "learn/motion_range.hpp"

#include <algorithm>
#include <cmath>

#include "core/constants.hpp"
#include "core/median.hpp"
#include "model/feature_matrix.hpp"

namespace ravencal::learn {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using record::Recording;
using record::Role;

/// Arms move below 3 Hz, of which such windows keep 86 % and more; noise of efforts and steps of
/// encoders are faster.
constexpr double kSideS = 0.05;
constexpr Index kFewestSideRows = 2;
constexpr double kLongestGapRows = 10.0;
constexpr double kLowShare = 0.01;
constexpr double kHighShare = 0.99;
constexpr double kBeyondWidths = 0.125;

/// Means of the finite values between two rows.
class Means {
 public:
  explicit Means(const VectorXd& values) : sums_(values.size() + 1), counts_(values.size() + 1) {
    sums_[0] = counts_[0] = 0.0;
    for (Index row = 0; row < values.size(); ++row) {
      const bool is_known = std::isfinite(values[row]);
      sums_[row + 1] = sums_[row] + (is_known ? values[row] : 0.0);
      counts_[row + 1] = counts_[row] + (is_known ? 1.0 : 0.0);
    }
  }
  /// Over rows [begin, end); NaN without a value.
  [[nodiscard]] double over(Index begin, Index end) const {
    return (sums_[end] - sums_[begin]) / (counts_[end] - counts_[begin]);
  }

 private:
  VectorXd sums_;
  VectorXd counts_;
};

/// Rows [begin, end) around each row.
struct Window {
  Index begin;
  Index end;
};

/// Whether motion goes on from the row before.
std::vector<bool> continued(const Recording& recording) {
  const double longest_ns = kLongestGapRows * model::row_period_s(recording) / core::kSecondsPerNs;
  std::vector<bool> goes_on(recording.t_ns.size(), false);
  for (std::size_t row = 1; row < goes_on.size(); ++row) {
    const auto gap_ns = static_cast<double>(recording.t_ns[row] - recording.t_ns[row - 1]);
    goes_on[row] = gap_ns <= longest_ns;
  }
  for (const record::Event& event : recording.events) {
    if (event.kind != "episode") continue;
    const auto row = std::lower_bound(recording.t_ns.begin(), recording.t_ns.end(), event.t_ns);
    if (row != recording.t_ns.end())
      goes_on[static_cast<std::size_t>(row - recording.t_ns.begin())] = false;
  }
  return goes_on;
}

std::vector<Window> windows_of(const Recording& recording, const VectorXd& t_s) {
  const std::vector<bool> goes_on = continued(recording);
  std::vector<Window> windows(goes_on.size());
  Index begin = 0;
  for (Index row = 0; row < t_s.size(); ++row) {
    if (!goes_on[static_cast<std::size_t>(row)]) begin = row;
    while (begin + kFewestSideRows < row && t_s[begin] < t_s[row] - kSideS) ++begin;
    windows[static_cast<std::size_t>(row)].begin = begin;
  }
  Index end = t_s.size();
  for (Index row = t_s.size() - 1; row >= 0; --row) {
    while (end > row + 1 + kFewestSideRows && t_s[end - 1] > t_s[row] + kSideS) --end;
    windows[static_cast<std::size_t>(row)].end = end;
    if (!goes_on[static_cast<std::size_t>(row)]) end = row;
  }
  return windows;
}

VectorXd times_s(const Recording& recording) {
  VectorXd t_s(recording.rows());
  for (Index row = 0; row < t_s.size(); ++row) {
    const std::int64_t t_ns = recording.t_ns[static_cast<std::size_t>(row)];
    t_s[row] = static_cast<double>(t_ns - recording.t_ns.front()) * core::kSecondsPerNs;
  }
  return t_s;
}

VectorXd speeds_of(const VectorXd& position, const VectorXd& t_s,
                   const std::vector<Window>& windows) {
  const Means positions(position);
  const VectorXd lost = VectorXd::Constant(t_s.size(), std::nan(""));
  const Means times(position.array().isFinite().select(t_s, lost));
  VectorXd speeds(position.size());
  for (Index row = 0; row < position.size(); ++row) {
    const auto [begin, end] = windows[static_cast<std::size_t>(row)];
    const double travel = positions.over(row, end) - positions.over(begin, row + 1);
    const double time_s = times.over(row, end) - times.over(begin, row + 1);
    speeds[row] = time_s > 0.0 ? travel / time_s : std::nan("");
  }
  return speeds;
}

/// Appends the known values of rows that have a truth.
void collect(const Recording& recording, const model::OutputSpec& output,
             const Eigen::Ref<const VectorXd>& values, std::vector<double>& collected) {
  const auto truth = recording.column(Role::kJointTruth, output.joint);
  if (!truth) return;
  for (Index row = 0; row < values.size(); ++row) {
    const bool is_known =
        std::isfinite(values[row]) && std::isfinite(recording.samples(row, *truth));
    if (is_known) collected.push_back(values[row]);
  }
}

model::Range range_of(const std::vector<double>& values) {
  if (values.empty()) return {};
  return {core::upper_quantile(values, kLowShare), core::upper_quantile(values, kHighShare)};
}

bool is_beyond(const model::Range& range, double value) {
  const double margin = kBeyondWidths * (range.high - range.low);
  return value < range.low - margin || value > range.high + margin;
}

template <typename ColumnOf>
Eigen::MatrixXd window_means(std::span<const model::OutputSpec> outputs, const Recording& recording,
                             const ColumnOf& column_of) {
  const std::vector<Window> windows = windows_of(recording, times_s(recording));
  Eigen::MatrixXd values(recording.rows(), static_cast<Index>(outputs.size()));
  values.setConstant(std::nan(""));
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const auto column = column_of(recording, outputs[k].joint);
    if (!column) continue;
    const Means means(recording.samples.col(*column));
    for (Index row = 0; row < recording.rows(); ++row) {
      const auto [begin, end] = windows[static_cast<std::size_t>(row)];
      values(row, static_cast<Index>(k)) = means.over(begin, end);
    }
  }
  return values;
}

}  // namespace

std::optional<Index> effort_column(const Recording& recording, std::string_view joint) {
  const auto torque = recording.column(Role::kDriveTorque, joint);
  return torque ? torque : recording.column(Role::kDriveInput, joint);
}

Eigen::MatrixXd joint_speeds(std::span<const model::OutputSpec> outputs,
                             const Recording& recording) {
  const VectorXd t_s = times_s(recording);
  const std::vector<Window> windows = windows_of(recording, t_s);
  Eigen::MatrixXd speeds(recording.rows(), static_cast<Index>(outputs.size()));
  speeds.setConstant(std::nan(""));
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    const auto column = recording.column(outputs[k].estimate_channel);
    if (!column) continue;
    speeds.col(static_cast<Index>(k)) = speeds_of(recording.samples.col(*column), t_s, windows);
  }
  return speeds;
}

Eigen::MatrixXd joint_efforts(std::span<const model::OutputSpec> outputs,
                              const Recording& recording) {
  return window_means(outputs, recording, effort_column);
}

Eigen::MatrixXd joint_loads(std::span<const model::OutputSpec> outputs,
                            const Recording& recording) {
  return window_means(outputs, recording, [](const Recording& of, std::string_view joint) {
    return of.column(Role::kLoad, joint);
  });
}

model::MotionRange motion_range(std::span<const model::OutputSpec> outputs,
                                std::span<const Recording* const> training) {
  std::vector<std::vector<double>> speeds(outputs.size());
  std::vector<std::vector<double>> loads(outputs.size());
  model::MotionRange range(outputs.size());
  for (const Recording* recording : training) {
    const Eigen::MatrixXd speed = joint_speeds(outputs, *recording);
    const Eigen::MatrixXd effort = joint_efforts(outputs, *recording);
    for (std::size_t k = 0; k < outputs.size(); ++k) {
      collect(*recording, outputs[k], speed.col(static_cast<Index>(k)), speeds[k]);
      collect(*recording, outputs[k], effort.col(static_cast<Index>(k)), loads[k]);
      const auto column = effort_column(*recording, outputs[k].joint);
      if (column)
        range[k].load_channel = recording->channels[static_cast<std::size_t>(*column)].name;
    }
  }
  for (std::size_t k = 0; k < outputs.size(); ++k) {
    range[k].speed = range_of(speeds[k]);
    range[k].load = range_of(loads[k]);
  }
  return range;
}

RowFlags beyond_motion(const model::MotionRange& range, std::span<const model::OutputSpec> outputs,
                       const Recording& recording) {
  const Eigen::MatrixXd speeds = joint_speeds(outputs, recording);
  const Eigen::MatrixXd efforts = joint_efforts(outputs, recording);
  RowFlags beyond(speeds.rows(), speeds.cols());
  for (std::size_t k = 0; k < range.size(); ++k) {
    const auto column = effort_column(recording, outputs[k].joint);
    const bool is_same = column && recording.channels[static_cast<std::size_t>(*column)].name ==
                                       range[k].load_channel;
    const auto joint = static_cast<Index>(k);
    for (Index row = 0; row < speeds.rows(); ++row) {
      beyond(row, joint) = is_beyond(range[k].speed, speeds(row, joint)) ||
                           (is_same && is_beyond(range[k].load, efforts(row, joint)));
    }
  }
  return beyond;
}

}  // namespace ravencal::learn
