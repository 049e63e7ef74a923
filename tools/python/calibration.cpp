// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <utility>

#include "choice/choice_table.hpp"
#include "choice/choose.hpp"
#include "core/known_words.hpp"
#include "core/whole_file.hpp"
#include "learn/distinct.hpp"
#include "learn/evaluate.hpp"
#include "learn/onnx_file.hpp"
#include "learn/recordings_at_hook.hpp"
#include "python/arrays.hpp"
#include "python/long_work.hpp"
#include "python/module.hpp"
#include "python/recording.hpp"
#include "record/plausibility.hpp"

namespace ravencal::python {
namespace {

namespace fs = std::filesystem;
using learn::JointEvaluation;

/// ravencal.Model.
struct TrainedModel {
  model::CalibrationModel model;
  std::string choice{};  ///< what was tried; empty of a model that was read
  std::vector<std::string> warnings{};
};

/// ravencal.Evaluation.
struct JudgedModel {
  learn::Evaluation evaluation;
  std::vector<std::string> warnings;
};

/// The value of a word of the user's; `what` names the argument.
template <typename Value>
Value meant(const char* what, const std::string& word, const std::map<std::string, Value>& known) {
  const auto it = known.find(word);
  if (it != known.end()) return it->second;
  std::vector<std::string> words;
  words.reserve(known.size());
  for (const auto& [name, value] : known) words.push_back(name);
  throw Failure(
      core::usage_error(fmt::format("{}: '{}'{}", what, word, core::instead_of(word, words))));
}

/// Pointers to recordings, of which there is at least one.
std::vector<const record::Recording*> pointers_to(const std::vector<RecordingPointer>& recordings) {
  if (recordings.empty()) throw Failure(core::usage_error("give at least one recording"));
  std::vector<const record::Recording*> pointers;
  pointers.reserve(recordings.size());
  for (const RecordingPointer& held : recordings) pointers.push_back(&held->recording);
  return pointers;
}

/// What lies in files; recordings that were made in memory have none.
core::Status check_distinct_files(const std::vector<const record::Recording*>& recordings) {
  std::vector<std::string> files;
  for (const record::Recording* recording : recordings)
    if (fs::is_regular_file(recording->source)) files.push_back(recording->source);
  return learn::check_distinct(files, {});
}

TrainedModel train(const py::object& training, choice::ChoiceOptions options,
                   const py::object& progress) {
  const std::vector<RecordingPointer> held = recordings_of(training);
  const auto recordings = pointers_to(held);
  options.at_hook = learn::is_at_hook(learn::Latched::kAuto, *recordings.front());
  const auto work = [&](Watch& watch) -> core::Result<choice::Choice> {
    RAVENCAL_RETURN_IF_ERROR(check_distinct_files(recordings));
    RAVENCAL_ASSIGN_OR_RETURN(auto implausible, record::plausibility_warnings(recordings));
    RAVENCAL_ASSIGN_OR_RETURN(
        choice::Choice chosen,
        choice::choose_model(recordings, options, [&](double share, const std::string& candidate) {
          return watch.go_on(share, candidate);
        }));
    learn::keep_with(chosen.model, implausible);
    std::move(implausible.begin(), implausible.end(), std::back_inserter(chosen.warnings));
    return chosen;
  };
  choice::Choice chosen = away_from_python(progress, work);
  std::string table = choice::choice_table(chosen);
  return {std::move(chosen.model), std::move(table), std::move(chosen.warnings)};
}

JudgedModel evaluate(const TrainedModel& trained, const py::object& tested, bool same_seed) {
  const std::vector<RecordingPointer> held = recordings_of(tested);
  const auto recordings = pointers_to(held);
  return away_from_python(py::none(), [&](const Watch&) -> core::Result<JudgedModel> {
    RAVENCAL_ASSIGN_OR_RETURN(auto implausible, record::plausibility_warnings(recordings));
    const learn::SharedSeeds shared = learn::shared_seeds(trained.model.seeds, recordings);
    if (!same_seed) RAVENCAL_RETURN_IF_ERROR(learn::check_run_seeds(shared));
    RAVENCAL_ASSIGN_OR_RETURN(learn::Evaluation evaluation,
                              learn::evaluate(trained.model, recordings));
    evaluation.shared = shared;
    std::vector<std::string> warnings = learn::warnings_of(evaluation, trained.model, recordings);
    std::move(implausible.begin(), implausible.end(), std::back_inserter(warnings));
    return JudgedModel{std::move(evaluation), std::move(warnings)};
  });
}

void save_model(const TrainedModel& trained, const fs::path& path, bool overwrite) {
  if (!overwrite && fs::exists(path)) throw Failure(core::exists_already(path));
  succeed(learn::write_onnx(trained.model, path));
}

const JointEvaluation& joint_of(const JudgedModel& judged, const std::string& name) {
  std::vector<std::string> names;
  for (const JointEvaluation& joint : judged.evaluation.joints) {
    if (joint.joint == name) return joint;
    names.push_back(joint.joint);
  }
  throw py::key_error(fmt::format("no joint '{}'{}", name, core::instead_of(name, names)));
}

void add_model(py::module_& module) {
  py::class_<TrainedModel>(module, "Model", "A calibration: what it corrects, from which inputs.")
      .def_static(
          "load",
          [](const fs::path& path) { return TrainedModel{value_of(learn::read_onnx(path))}; },
          py::arg("path"))
      .def("save", &save_model, py::arg("path"), py::kw_only(), py::arg("overwrite") = false)
      .def_property_readonly("joints",
                             [](const TrainedModel& t) {
                               std::vector<std::string> names;
                               for (const auto& output : t.model.outputs)
                                 names.push_back(output.joint);
                               return names;
                             })
      .def_property_readonly("features",
                             [](const TrainedModel& t) {
                               std::vector<std::string> texts;
                               for (const auto& feature : t.model.features)
                                 texts.push_back(feature.text());
                               return texts;
                             })
      .def_property_readonly("origin",
                             [](const TrainedModel& t) { return model::describe(t.model.origin); })
      .def_property_readonly("provenance", [](const TrainedModel& t) { return t.model.provenance; })
      .def_readonly("choice", &TrainedModel::choice)
      .def_readonly("warnings", &TrainedModel::warnings);
}

void add_evaluation(py::module_& module) {
  py::class_<learn::ErrorStatistics>(module, "ErrorStatistics", "Of a joint's error, SI units.")
      .def_readonly("rmse", &learn::ErrorStatistics::rmse)
      .def_readonly("peak", &learn::ErrorStatistics::peak);
  const auto series = [](auto member) {
    return [member](const py::object& self) {
      return read_only_view(self.cast<const JointEvaluation&>().*member, self);
    };
  };
  py::class_<JointEvaluation>(module, "JointEvaluation", "How well one joint is corrected.")
      .def_readonly("joint", &JointEvaluation::joint)
      .def_readonly("unit", &JointEvaluation::unit)
      .def_readonly("raw", &JointEvaluation::raw)
      .def_readonly("bias_removed", &JointEvaluation::bias_removed)
      .def_readonly("calibrated", &JointEvaluation::calibrated)
      .def_property_readonly("t_s", series(&JointEvaluation::t_s))
      .def_property_readonly("truth", series(&JointEvaluation::truth))
      .def_property_readonly("estimate", series(&JointEvaluation::estimate))
      .def_property_readonly("corrected", series(&JointEvaluation::corrected));
  py::class_<JudgedModel>(module, "Evaluation", "How well a model corrects recordings.")
      .def_property_readonly("joints",
                             [](const JudgedModel& judged) { return judged.evaluation.joints; })
      .def("__getitem__", &joint_of, py::arg("joint"), py::return_value_policy::copy)
      .def_readonly("warnings", &JudgedModel::warnings)
      .def("json",
           [](const JudgedModel& judged) { return learn::evaluation_json(judged.evaluation); })
      .def("__str__",
           [](const JudgedModel& judged) { return learn::evaluation_table(judged.evaluation); });
}

}  // namespace

void add_calibration(py::module_& module) {
  add_model(module);
  add_evaluation(module);
  module.def(
      "train",
      [](const py::object& training, const std::string& method, const std::string& features,
         const std::vector<std::string>& joints, std::uint64_t seed, const std::string& arm,
         const std::string& robot, const std::string& controller, const std::string& coordinates,
         const std::string& session, const py::object& progress) {
        using choice::Kinds;
        using choice::SessionRule;
        using model::Arm;
        using model::Coordinates;
        choice::ChoiceOptions options;
        options.kinds = meant<Kinds>(
            "method", method,
            {{"auto", Kinds::kAll}, {"linear", Kinds::kLinear}, {"units", Kinds::kUnits}});
        options.features = features;
        options.joints = joints;
        options.seed = seed;
        options.origin = {
            meant<Arm>("arm", arm,
                       {{"", Arm::kUnknown}, {"gold", Arm::kGold}, {"green", Arm::kGreen}}),
            meant<Coordinates>("coordinates", coordinates,
                               {{"", Coordinates::kUnknown},
                                {"motor", Coordinates::kMotor},
                                {"corrected", Coordinates::kCorrected}}),
            robot, controller};
        options.sessions = meant<SessionRule>("session", session,
                                              {{"auto", SessionRule::kAuto},
                                               {"recording", SessionRule::kRecording},
                                               {"none", SessionRule::kNone}});
        return train(training, std::move(options), progress);
      },
      "Learns the joint error from recordings.", py::arg("training"), py::kw_only(),
      py::arg("method") = "auto", py::arg("features") = "",
      py::arg("joints") = std::vector<std::string>(), py::arg("seed") = 3, py::arg("arm") = "",
      py::arg("robot") = "", py::arg("controller") = "", py::arg("coordinates") = "",
      py::arg("session") = "auto", py::arg("progress") = py::none());
  module.def("evaluate", &evaluate, "Says how well a model corrects recordings.", py::arg("model"),
             py::arg("recordings"), py::kw_only(), py::arg("same_seed") = false);
}

}  // namespace ravencal::python
