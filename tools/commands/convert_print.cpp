// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "commands/convert.hpp"
#include "core/units.hpp"
#include "learn/evaluate.hpp"
#include "model/loop_text.hpp"

namespace ravencal::commands::convert {
namespace {

using conversion::WeightsCheck;

void print(const WeightsCheck& check, double limit_percent) {
  fmt::print("check: {} rows, {} with inputs that the plugin clamps", check.rows,
             check.rows_clamped);
  if (check.rows_lost > 0)
    fmt::print(", {} left out (lost values, windows not whole)", check.rows_lost);
  fmt::print("; confidence 1 in {}, 0 in {}\n", check.rows_trusted, check.rows_doubted);
  for (const conversion::JointCheck& joint : check.joints) {
    const core::DisplayUnit unit = core::display_unit(joint.unit);
    fmt::print("  {:<12} largest difference {:.3g} {}, where inputs are clamped {:.3g} {}\n",
               joint.joint, joint.largest_difference * unit.per_si, unit.name,
               joint.largest_clamped_difference * unit.per_si, unit.name);
    const auto change = joint.rmse_change_percent();
    if (!change) continue;
    const bool above = !(*change <= limit_percent);
    fmt::print("  {:<12} RMSE {:.4g} {} in f32, {:.4g} {} as packed: {:+.3f} %{}\n", "",
               *joint.model_rmse * unit.per_si, unit.name, *joint.weights_rmse * unit.per_si,
               unit.name, *change, above ? fmt::format(", above {:g} %", limit_percent) : "");
  }
}

void print(const conversion::SourceCheck& check, const std::string& origin) {
  fmt::print("source ({}): run beside the weights on {} random inputs{}\n", origin, check.rows,
             check.samples > 1 ? fmt::format(", windows of {} samples", check.samples) : "");
  for (const conversion::SourceDifference& joint : check.joints) {
    const core::DisplayUnit unit = core::display_unit(joint.unit);
    fmt::print("  {:<12} largest difference {:.3g} {}, {:.2g} of its spread of {:.3g} {}\n",
               joint.joint, joint.largest * unit.per_si, unit.name,
               joint.spread > 0.0 ? joint.largest / joint.spread : 0.0, joint.spread * unit.per_si,
               unit.name);
  }
}

}  // namespace

void print(const Arguments& arguments, const Outcome& outcome) {
  if (outcome.calibration_rows > 0) {
    fmt::print("calibrated on {}, {} rows\n", fmt::join(calibration_files(arguments), ", "),
               outcome.calibration_rows);
  }
  if (arguments.compact) {
    fmt::print(
        "compact: {} of {} inputs, {} of {} weights; outputs change by {:.3g} % of their "
        "spread\n",
        outcome.compacted.kept_inputs.size(), outcome.model.features.size(),
        outcome.compacted.weights_after, outcome.compacted.weights_before,
        100.0 * outcome.compacted.output_change);
  }
  if (outcome.source_check) {
    print(*outcome.source_check, outcome.foreign->model.origin);
    if (!outcome.model.trust) {
      fmt::print(
          "no joint trust region (the plugin judges inputs one by one only): --calibrate with the "
          "recordings of the training fits one\n");
    }
  }
  if (outcome.check) {
    print(*outcome.check, arguments.max_rmse_change_percent);
  } else if (!is_exact(arguments)) {
    fmt::print("not checked: --check RECORDING shows what {} costs\n",
               arguments.precision == "f32" ? "--compact" : arguments.precision);
  }
  fmt::print("{}", model::loop_text(outcome.compacted.model));
  if (outcome.margins) fmt::print("{}", loop::describe(*outcome.margins));
  if (outcome.is_unstable) {
    fmt::print(
        "{} is not written: the margins of the loop through correction and servo are too small, so "
        "the arm may oscillate; train with --features light-open or --loop-noise (--unbounded-loop "
        "writes "
        "it all the same)\n",
        arguments.out);
    return;
  }
  if (outcome.is_other) {
    fmt::print("{} is not written: the weights do not compute what {} does; please report it\n",
               arguments.out, arguments.model);
    return;
  }
  if (!outcome.accepted) {
    fmt::print("{} is not written: it costs too much accuracy (--max-rmse-change); {}\n",
               arguments.out,
               arguments.precision == "int8"   ? "--precision bf16 rounds weights less"
               : arguments.precision == "bf16" ? "--precision f32 rounds no weight"
                                               : "give --compact a smaller budget");
    return;
  }
  fmt::print("origin: {}\n", describe(outcome.model.origin));
  const std::size_t bytes = bytes_per_step(outcome.blob);
  fmt::print("{}: {} bytes, {}, {} inputs, {} outputs; {} bytes per step, 1/{:.3g} of f32\n",
             arguments.out, outcome.blob.size(), arguments.precision,
             outcome.compacted.model.features.size(), outcome.model.outputs.size(), bytes,
             static_cast<double>(outcome.f32_bytes_per_step) / static_cast<double>(bytes));
  fmt::print("self-test passed by the code for {}\n", fmt::join(outcome.kernels, ", "));
}

void print_json(const Arguments& arguments, const Outcome& outcome) {
  nlohmann::ordered_json json;
  json["weights"] = arguments.out;
  json["written"] = outcome.accepted;
  json["precision"] = arguments.precision;
  json["self_test_passed_by"] = outcome.kernels;
  json["loop"] = model::loop_json(outcome.compacted.model);
  const model::Origin& origin = outcome.model.origin;
  json["origin"] = {{"arm", name_of(origin.arm)},
                    {"robot", origin.robot},
                    {"controller", origin.controller},
                    {"coordinates", name_of(origin.coordinates)}};
  if (outcome.source_check) {
    json["source"] = {{"origin", outcome.foreign->model.origin},
                      {"rows", outcome.source_check->rows},
                      {"window", outcome.source_check->samples},
                      {"trust_region", outcome.model.trust.has_value()}};
    for (const conversion::SourceDifference& joint : outcome.source_check->joints) {
      json["source"]["joints"].push_back({{"joint", joint.joint},
                                          {"unit", joint.unit},
                                          {"largest_difference", joint.largest},
                                          {"spread", joint.spread}});
    }
  }
  json["calibration_rows"] = outcome.calibration_rows;
  json["inputs"] = outcome.compacted.model.features.size();
  json["bytes_per_step"] = bytes_per_step(outcome.blob);
  json["bytes_per_step_f32"] = outcome.f32_bytes_per_step;
  if (arguments.compact) {
    json["compact"] = {{"budget", arguments.budget},
                       {"weights_before", outcome.compacted.weights_before},
                       {"weights_after", outcome.compacted.weights_after},
                       {"output_change", outcome.compacted.output_change}};
  }
  if (outcome.check) {
    json["check"] = {{"rows", outcome.check->rows},
                     {"rows_clamped", outcome.check->rows_clamped},
                     {"rows_lost", outcome.check->rows_lost},
                     {"rows_trusted", outcome.check->rows_trusted},
                     {"rows_doubted", outcome.check->rows_doubted}};
    for (const conversion::JointCheck& joint : outcome.check->joints) {
      nlohmann::ordered_json item = {
          {"joint", joint.joint},
          {"unit", joint.unit},
          {"largest_difference", joint.largest_difference},
          {"largest_clamped_difference", joint.largest_clamped_difference}};
      if (const auto change = joint.rmse_change_percent()) {
        item["model_rmse"] = *joint.model_rmse;
        item["weights_rmse"] = *joint.weights_rmse;
        item["rmse_change_percent"] = *change;
      }
      json["check"]["joints"].push_back(std::move(item));
    }
  }
  fmt::print("{}\n", json.dump(2));
}

}  // namespace ravencal::commands::convert
