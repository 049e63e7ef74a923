// SPDX-License-Identifier: Apache-2.0
#include "trajectory/trajectory.hpp"

#include <fmt/format.h>

#include <charconv>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "commands/command.hpp"
#include "commands/commands.hpp"
#include "core/terminal.hpp"

namespace ravencal::commands {
namespace {

struct Options {
  std::string out;
  std::string plant;  // empty: a RAVEN arm in the authors' workspace
  std::string kind = "yz";
  std::string sparsity = "1/3";
  std::string mode = "paper";
  double duration_s = 600.0;
  double pace = 1.0;
  std::uint64_t seed = 1;
  bool json = false;
};

/// "1/3" or "3".
core::Result<int> divisions_from(std::string_view text) {
  std::string_view digits = text;
  if (digits.starts_with("1/")) digits.remove_prefix(2);
  int divisions = 0;
  const auto [end, error] =
      std::from_chars(digits.data(), digits.data() + digits.size(), divisions);
  if (error != std::errc{} || end != digits.data() + digits.size()) {
    return core::Error{core::ErrorCode::kUsage,
                       fmt::format("--sparsity '{}' must be written like 1/3", text)};
  }
  return divisions;
}

core::Status save(const trajectory::Trajectory& made, const Options& options) {
  RAVENCAL_RETURN_IF_ERROR(trajectory::write_csv(made, options.out));
  if (options.json) {
    const nlohmann::json summary = {{"file", options.out},
                                    {"samples", made.t_s.size()},
                                    {"duration_s", made.duration_s()},
                                    {"rate_hz", trajectory::kSampleRateHz}};
    core::say("{}\n", summary.dump());
  } else {
    core::say("{}: {:.1f} s, {} samples at {:.0f} Hz\n", options.out, made.duration_s(),
              made.t_s.size(), trajectory::kSampleRateHz);
  }
  return {};
}

core::Result<std::optional<trajectory::JointLimits>> limits_from(const Options& options) {
  if (options.plant.empty()) return std::optional<trajectory::JointLimits>();
  RAVENCAL_ASSIGN_OR_RETURN(const physics::Plant plant, physics::load_plant(options.plant));
  RAVENCAL_ASSIGN_OR_RETURN(trajectory::JointLimits limits, trajectory::limits_of(plant));
  return std::optional<trajectory::JointLimits>(std::move(limits));
}

core::Status run_zigzag(const Options& options) {
  trajectory::ZigzagOptions zigzag;
  RAVENCAL_ASSIGN_OR_RETURN(std::optional<trajectory::JointLimits> limits, limits_from(options));
  if (limits) zigzag.limits = std::move(*limits);
  RAVENCAL_ASSIGN_OR_RETURN(zigzag.kind, trajectory::zigzag_kind_from(options.kind));
  RAVENCAL_ASSIGN_OR_RETURN(zigzag.divisions, divisions_from(options.sparsity));
  zigzag.pace = options.pace;
  RAVENCAL_ASSIGN_OR_RETURN(const trajectory::Trajectory made, trajectory::make_zigzag(zigzag));
  return save(made, options);
}

core::Status run_sinusoid(const Options& options) {
  trajectory::RandomOptions random;
  RAVENCAL_ASSIGN_OR_RETURN(random.limits, limits_from(options));
  random.mode =
      options.mode == "code" ? trajectory::RandomMode::kCode : trajectory::RandomMode::kPaper;
  random.duration_s = options.duration_s;
  random.seed = options.seed;
  random.pace = options.pace;
  RAVENCAL_ASSIGN_OR_RETURN(const trajectory::Trajectory made, trajectory::make_random(random));
  return save(made, options);
}

void add_common(CLI::App& command, Options& options) {
  command
      .add_option("--out", options.out,
                  "CSV to write: t_s and NAME_rad or NAME_m of each joint (RAVEN: "
                  "t_s,shoulder_rad,elbow_rad,insertion_m)")
      ->required();
  command.add_option("--plant", options.plant,
                     "Robot (.toml or a model) of any number of joints, whose [joint.limits] say "
                     "between which positions and how fast they move; default: a RAVEN arm in the "
                     "authors' workspace. What is around the robot, and its links, it has to avoid "
                     "by these limits");
  command
      .add_option("--pace", options.pace, "Times the authors' speeds, or those of [joint.limits]")
      ->capture_default_str();
  command.add_flag("--json", options.json, "Print the summary as JSON");
}

}  // namespace

void add_trajectory(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command =
      app.add_subcommand("trajectory", "Make a joint trajectory for calibration or test");
  command->require_subcommand(1);

  CLI::App* zigzag =
      command->add_subcommand("zigzag", "Calibration: a zig-zag through the workspace");
  add_common(*zigzag, *options);
  zigzag->add_option("--sparsity", options->sparsity, "Step between sweeps, as a share of the edge")
      ->capture_default_str();
  zigzag
      ->add_option(
          "--kind", options->kind,
          "Direction of the sweeps of three joints: x, y, z, xy, yz, xz or xyz. Of any other "
          "number each joint sweeps in turn")
      ->capture_default_str();
  zigzag->footer(
      "Example: ravencal trajectory zigzag --sparsity 1/4 --out zigzag4.csv\n"
      "         ravencal trajectory zigzag --plant arm7.toml --out sweeps.csv");
  on_call(*zigzag, exit_code, {.read = {"--plant"}, .written = {"--out"}},
          [options] { return run_zigzag(*options); });

  CLI::App* sinusoid =
      command->add_subcommand("sinusoid", "Test: random targets and speeds per joint");
  add_common(*sinusoid, *options);
  sinusoid->add_option("--duration-s", options->duration_s, "Length, s")->capture_default_str();
  sinusoid->add_option("--seed", options->seed, "Random seed")->capture_default_str();
  sinusoid->add_option("--mode", options->mode, "paper: half cosines; code: the authors' script")
      ->check(CLI::IsMember({"paper", "code"}))
      ->capture_default_str();
  sinusoid->footer(
      "Example: ravencal trajectory sinusoid --duration-s 1200 --seed 7 --out test.csv");
  on_call(*sinusoid, exit_code, {.read = {"--plant"}, .written = {"--out"}},
          [options] { return run_sinusoid(*options); });

  command->footer("Example: ravencal trajectory zigzag --sparsity 1/3 --out zigzag3.csv");
}

}  // namespace ravencal::commands
