// SPDX-License-Identifier: Apache-2.0
//
// Several recordings as one table of thinned rows: what the series of a joint are built from.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string_view>
#include <vector>

#include "diagnose/series/series.hpp"
#include "record/recording.hpp"

namespace ravencal::diagnose {

/// Columns of one signal over all recordings, end to end; NaN where a recording lacks it.
class Table {
 public:
  Table(const std::vector<record::Recording>& training,
        const std::vector<record::Recording>& held_out, const SeriesOptions& options)
      : options_(options) {
    for (const record::Recording& recording : training) add(recording, false);
    for (const record::Recording& recording : held_out) add(recording, true);
    stride_ = std::max<Eigen::Index>(1, (rows_ + options.most_rows - 1) / options.most_rows);
    lay_out_rows();
  }

  [[nodiscard]] bool has(record::Role role, std::string_view joint) const {
    return std::any_of(sources_.begin(), sources_.end(), [&](const Source& source) {
      return source.recording->column(role, joint).has_value();
    });
  }

  /// Thinned samples of the first channel with that role and joint.
  [[nodiscard]] Eigen::VectorXd signal(record::Role role, std::string_view joint) const {
    return gather(
        [&](const record::Recording& recording) { return recording.column(role, joint); });
  }
  [[nodiscard]] Eigen::VectorXd signal(std::string_view name) const {
    return gather([&](const record::Recording& recording) { return recording.column(name); });
  }

  /// Lost samples take the value before them.
  static Eigen::VectorXd bridged(Eigen::VectorXd x) {
    double last = 0.0;
    for (double& value : x) {
      if (!std::isfinite(value)) value = last;
      last = value;
    }
    return x;
  }

  [[nodiscard]] const std::vector<record::Channel>& channels() const {
    return sources_.front().recording->channels;
  }
  [[nodiscard]] const Eigen::VectorXd& t_s() const { return t_s_; }
  [[nodiscard]] const std::vector<int>& recording() const { return recording_; }
  [[nodiscard]] const std::vector<char>& fresh() const { return fresh_; }
  [[nodiscard]] const std::vector<char>& held_out() const { return held_out_; }
  [[nodiscard]] Eigen::Index rows() const { return t_s_.size(); }

 private:
  struct Source {
    const record::Recording* recording;
    bool held_out;
  };

  void add(const record::Recording& recording, bool held_out) {
    sources_.push_back({&recording, held_out});
    rows_ += recording.rows();
  }

  void lay_out_rows() {
    Eigen::Index count = 0;
    for (const Source& source : sources_) count += source.recording->rows() / stride_;
    t_s_.resize(count);
    Eigen::Index at = 0;
    for (std::size_t s = 0; s < sources_.size(); ++s) {
      const record::Recording& recording = *sources_[s].recording;
      std::vector<std::int64_t> starts;
      for (const record::Event& event : recording.events) {
        if (event.kind == "episode" || event.kind == "homing") starts.push_back(event.t_ns);
      }
      std::sort(starts.begin(), starts.end());
      std::size_t next = 0;
      for (Eigen::Index i = 0; i < recording.rows() / stride_; ++i, ++at) {
        const std::int64_t t_ns = recording.t_ns[static_cast<std::size_t>(i * stride_)];
        bool starts_here = i == 0;
        for (; next < starts.size() && starts[next] <= t_ns; ++next) starts_here = true;
        t_s_[at] = static_cast<double>(t_ns - recording.t_ns.front()) * 1e-9;
        recording_.push_back(static_cast<int>(s));
        fresh_.push_back(starts_here ? 1 : 0);
        const bool late = options_.held_out_from_s && t_s_[at] >= *options_.held_out_from_s;
        held_out_.push_back(sources_[s].held_out || late ? 1 : 0);
      }
    }
  }

  template <typename Find>
  [[nodiscard]] Eigen::VectorXd gather(Find&& find) const {
    Eigen::VectorXd out =
        Eigen::VectorXd::Constant(rows(), std::numeric_limits<double>::quiet_NaN());
    Eigen::Index at = 0;
    for (const Source& source : sources_) {
      const Eigen::Index count = source.recording->rows() / stride_;
      if (const auto column = find(*source.recording)) {
        for (Eigen::Index i = 0; i < count; ++i) {
          out[at + i] = source.recording->samples.col(*column).segment(i * stride_, stride_).mean();
        }
      }
      at += count;
    }
    return out;
  }

  const SeriesOptions& options_;
  std::vector<Source> sources_;
  Eigen::Index rows_ = 0;
  Eigen::Index stride_ = 1;
  Eigen::VectorXd t_s_;
  std::vector<int> recording_;
  std::vector<char> fresh_;
  std::vector<char> held_out_;
};

}  // namespace ravencal::diagnose
