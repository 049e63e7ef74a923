// SPDX-License-Identifier: Apache-2.0
#include "report/joint_view.hpp"

#include <cstddef>

namespace ravencal::report {

JointView view_of(const JointSeries& series) {
  JointView view{series, timeline_of(series.t_s), {}, {}, {}, series.velocity_sign};
  const std::size_t samples = series.truth.size();
  view.raw_error.reserve(samples);
  view.bias_removed_error.reserve(samples);
  view.corrected_error.reserve(samples);
  for (std::size_t i = 0; i < samples; ++i) {
    const double raw = series.raw[i] - series.truth[i];
    view.raw_error.push_back(raw);
    view.bias_removed_error.push_back(raw - series.bias);
    view.corrected_error.push_back(series.corrected[i] - series.truth[i]);
  }
  if (view.direction.empty()) view.direction = direction_of_motion(view.timeline, series.truth);
  return view;
}

}  // namespace ravencal::report
