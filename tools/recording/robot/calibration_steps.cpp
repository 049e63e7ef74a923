// SPDX-License-Identifier: Apache-2.0
#include "robot/calibration_steps.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/whole_file.hpp"

namespace ravencal::robot {
namespace {

namespace fs = std::filesystem;
using Arguments = std::vector<std::string>;

// The authors' random motion goes faster than their follower.
constexpr const char* kRandomSpeed = "3,4,7";
constexpr int kValidateSeed = 101;
constexpr int kTestSeed = 102;
constexpr const char* kSafety =
    "Keep the E-stop in reach and everybody out of the arm's reach, then press the pedal; letting "
    "it go pauses.";

std::string underscored(std::string text) {
  std::replace(text.begin(), text.end(), '/', '_');
  return text;
}

class Steps {
 public:
  explicit Steps(const CalibrationOptions& options) : options_(options) {}

  std::vector<CalibrationStep> take() { return std::move(steps_); }

  [[nodiscard]] std::string path(const std::string& name) const {
    return (options_.folder / name).string();
  }

  void look() {
    steps_.push_back({"check", "robot and external encoders are there",
                      "Start the robot's control process and `ravencal-encoders --home "
                      "--publish-ros`.",
                      with_robot({"run", "--check"}), "", false});
    steps_.push_back({"home", "the robot is homed",
                      "Release the E-stop and press the silver button; the robot homes and the "
                      "encoders find their zeros at its hard stops.",
                      with_robot({"run", "--await-homed"}), "", false});
  }

  void motion(const std::string& name, const std::string& title, Arguments trajectory,
              const char* speed) {
    const std::string csv = path(name + ".csv");
    trajectory.insert(trajectory.end(), {"--out", csv, "--force"});
    steps_.push_back({name + "_path", title + ": the path", "", std::move(trajectory), csv, false});
    Arguments run = with_robot({"run", "--trajectory", csv, "--out", path(name + ".db")});
    if (speed != nullptr) run.insert(run.end(), {"--max-speed", speed});
    steps_.push_back({name, title, kSafety, std::move(run), path(name + ".db"), true});
  }

  void calculation(const std::string& id, const std::string& title, Arguments command,
                   const std::string& output) {
    command.emplace_back("--force");  // of a step that was stopped, something may be there
    steps_.push_back({id, title, "", std::move(command), path(output), false});
  }

 private:
  [[nodiscard]] Arguments with_robot(Arguments command) const {
    command.insert(command.end(),
                   {"--arm", options_.arm, "--stale-s", fmt::format("{}", options_.stale_s),
                    "--wait-s", fmt::format("{}", options_.wait_s)});
    if (!options_.crtk_arm.empty())
      command.insert(command.end(), {"--crtk-arm", options_.crtk_arm});
    return command;
  }

  const CalibrationOptions& options_;
  std::vector<CalibrationStep> steps_;
};

/// What an earlier session must have in common with this one: everything that shapes its files.
std::string settings_of(const CalibrationOptions& options) {
  return nlohmann::json{{"arm", options.arm},
                        {"crtk_arm", options.crtk_arm},
                        {"sparsities", options.sparsities},
                        {"validate_s", options.validate_s},
                        {"test_s", options.test_s},
                        {"features", options.features},
                        {"hidden", options.hidden},
                        {"epochs", options.epochs},
                        {"precision", options.precision}}
      .dump();
}

core::Status write_session(const fs::path& file, const std::string& settings,
                           const std::set<std::string>& done) {
  const nlohmann::ordered_json json = {
      {"schema", 1}, {"settings", nlohmann::json::parse(settings)}, {"done", done}};
  return core::write_whole_file(file, json.dump(2) + "\n");
}

}  // namespace

std::vector<CalibrationStep> calibration_steps(const CalibrationOptions& options) {
  Steps steps(options);
  steps.look();
  Arguments train = {"train"};
  for (const std::string& sparsity : options.sparsities) {
    const std::string name = "zigzag_" + underscored(sparsity);
    steps.motion(name, "zig-zag with sparsity " + sparsity,
                 {"trajectory", "zigzag", "--sparsity", sparsity}, nullptr);
    train.push_back(steps.path(name + ".db"));
  }
  const auto random = [&](const std::string& name, const std::string& title, double duration_s,
                          int seed) {
    steps.motion(name, title,
                 {"trajectory", "sinusoid", "--duration-s", fmt::format("{}", duration_s), "--seed",
                  std::to_string(seed)},
                 kRandomSpeed);
  };
  random("validate", "random motion that chooses the best epoch", options.validate_s,
         kValidateSeed);
  random("test", "random motion that tests the result", options.test_s, kTestSeed);

  const std::string model = steps.path("model.onnx");
  train.insert(train.end(),
               {"--validate", steps.path("validate.db"), "--features", options.features, "--hidden",
                options.hidden, "--epochs", std::to_string(options.epochs), "--seed", "1", "--out",
                model, "--report", steps.path("train.html")});
  steps.calculation("train", "training", std::move(train), "model.onnx");
  steps.calculation("report", "the errors before and after, on the test",
                    {"evaluate", model, steps.path("test.db"), "--json",
                     steps.path("evaluate.json"), "--report", steps.path("report.html")},
                    "report.html");
  Arguments convert = {"convert",     model,
                       "--out",       steps.path("weights.blob"),
                       "--precision", options.precision,
                       "--check",     steps.path("test.db")};
  if (options.precision == "int8") {  // needs rows to choose its scales by
    convert.insert(convert.end(), {"--calibrate", steps.path("validate.db")});
  }
  steps.calculation("convert", "weights for the plugin", std::move(convert), "weights.blob");
  return steps.take();
}

std::string what_to_load(const CalibrationOptions& options) {
  const std::string blob = fs::absolute(options.folder / "weights.blob").string();
  return fmt::format(
      "Look at {} first. To use it, in the controller's settings (rt_plugin/integration):\n"
      "  settings.weights = \"{}\";\n"
      "or, into a running one, calibration.load(\"{}\").\n"
      "On the virtual robot: ravencal robot --plant PLANT --plugin libravencal_plugin.so --weights "
      "{}\n"
      "It holds for this homing's cables and tool; test again after changing either.\n",
      (options.folder / "report.html").string(), blob, blob, blob);
}

core::Result<CalibrationSession> CalibrationSession::open(const CalibrationOptions& options) {
  std::error_code error;
  fs::create_directories(options.folder, error);
  if (error) {
    return core::Error{core::ErrorCode::kIo, fmt::format("{}: cannot be created: {}",
                                                         options.folder.string(), error.message())};
  }
  CalibrationSession session;
  session.file_ = options.folder / "calibrate.json";
  session.settings_ = settings_of(options);
  if (!fs::exists(session.file_)) {
    RAVENCAL_RETURN_IF_ERROR(write_session(session.file_, session.settings_, {}));
    return session;
  }
  std::ifstream file(session.file_);
  const auto json = nlohmann::json::parse(file, nullptr, false);
  if (!json.is_object() || !json.contains("settings") || !json.contains("done") ||
      !json["done"].is_array()) {
    return core::Error{
        core::ErrorCode::kData,
        fmt::format("{}: is no session; remove it to begin again", session.file_.string())};
  }
  if (json["settings"].dump() != session.settings_) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("{}: was begun with other settings ({}); use those or another "
                                   "--out",
                                   session.file_.string(), json["settings"].dump())};
  }
  for (const auto& id : json["done"]) {
    if (id.is_string()) session.done_.insert(id.get<std::string>());
  }
  return session;
}

bool CalibrationSession::done(const CalibrationStep& step) const {
  return !step.output.empty() && done_.contains(step.id) && fs::exists(step.output);
}

core::Status CalibrationSession::mark_done(const CalibrationStep& step) {
  done_.insert(step.id);
  return write_session(file_, settings_, done_);
}

core::Status set_aside(const fs::path& output) {
  if (output.empty() || !fs::exists(output)) return {};
  for (int number = 1;; ++number) {
    fs::path aside = output;
    aside.replace_extension(fmt::format(".stopped-{}{}", number, output.extension().string()));
    if (fs::exists(aside)) continue;
    std::error_code error;
    fs::rename(output, aside, error);
    if (!error) return {};
    return core::Error{core::ErrorCode::kIo,
                       fmt::format("{}: cannot be renamed: {}", output.string(), error.message())};
  }
}

}  // namespace ravencal::robot
