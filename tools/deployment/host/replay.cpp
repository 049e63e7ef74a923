// SPDX-License-Identifier: Apache-2.0
#include "host/replay.hpp"

#include <memory>
#include <optional>

#include "core/temporary_folder.hpp"
#include "host/robot_source.hpp"
#include "model/blob_writer.hpp"

namespace ravencal::host {
namespace {

core::Result<Summary> replay_one(const plugin_host::Library& library,
                                 const std::filesystem::path& weights,
                                 const model::CalibrationModel& model,
                                 const record::Recording& recording, const KeepGoing& keep_going) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::unique_ptr<RobotSource> source,
                            make_recording_source(recording, model.features));
  ravencal_config config = library.default_config(source->arm());
  config.step_budget_ns = 0;  // this machine is not the robot's
  RAVENCAL_ASSIGN_OR_RETURN(plugin_host::Instance plugin,
                            plugin_host::Instance::create(library, config));
  RAVENCAL_RETURN_IF_ERROR(plugin.load(weights));
  LoopOptions options;
  options.rate_hz = 0.0;
  options.ticks = source->cycles();
  return run(options, plugin, *source, model, keep_going);
}

/// Appends the rows of `more`; the figures are those of all rows.
void append(const Summary& more, Summary& all) {
  all.ticks += more.ticks;
  all.corrected_ticks += more.corrected_ticks;
  all.counters.limited_rate += more.counters.limited_rate;
  all.evaluation.rows += more.evaluation.rows;
  for (std::size_t k = 0; k < all.evaluation.joints.size(); ++k) {
    learn::JointEvaluation& joint = all.evaluation.joints[k];
    const learn::JointEvaluation& added = more.evaluation.joints[k];
    joint.t_s.insert(joint.t_s.end(), added.t_s.begin(), added.t_s.end());
    joint.truth.insert(joint.truth.end(), added.truth.begin(), added.truth.end());
    joint.estimate.insert(joint.estimate.end(), added.estimate.begin(), added.estimate.end());
    joint.corrected.insert(joint.corrected.end(), added.corrected.begin(), added.corrected.end());
    learn::set_figures(joint);
  }
}

}  // namespace

Summary run(const LoopOptions& options, plugin_host::Instance& plugin, RobotSource& source,
            const model::CalibrationModel& model, const KeepGoing& keep_going) {
  plugin.api().enable(plugin.get(), 1);
  const LoopResult result = run_loop(options, plugin, source, keep_going);
  return summarise(result, options, plugin, model);
}

core::Result<Summary> replay(const std::filesystem::path& plugin,
                             const model::CalibrationModel& model,
                             std::span<const record::Recording* const> recordings,
                             const KeepGoing& keep_going) {
  RAVENCAL_ASSIGN_OR_RETURN(const core::TemporaryFolder folder, core::TemporaryFolder::create());
  const std::filesystem::path weights = folder.path() / "model.blob";
  RAVENCAL_RETURN_IF_ERROR(model::write_blob(model, weights));
  RAVENCAL_ASSIGN_OR_RETURN(const plugin_host::Library library, plugin_host::Library::open(plugin));
  std::optional<Summary> all;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    const auto share = [&](double done) {
      return keep_going((static_cast<double>(i) + done) / static_cast<double>(recordings.size()));
    };
    RAVENCAL_ASSIGN_OR_RETURN(Summary one,
                              replay_one(library, weights, model, *recordings[i], share));
    if (all) {
      append(one, *all);
    } else {
      all = std::move(one);
    }
  }
  return std::move(*all);
}

}  // namespace ravencal::host
