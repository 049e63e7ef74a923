// SPDX-License-Identifier: Apache-2.0
#include "conversion/convert.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "core/units.hpp"
#include "learn/evaluate.hpp"
#include "model/loop_text.hpp"

namespace ravencal::conversion {
namespace {

std::string text_of(const WeightsCheck& check, double limit_percent) {
  std::string text = fmt::format("check: {} rows, {} with inputs that the plugin clamps",
                                 check.rows, check.rows_clamped);
  if (check.rows_lost > 0)
    text += fmt::format(", {} left out (lost values, windows not whole)", check.rows_lost);
  text += fmt::format("; confidence 1 in {}, 0 in {}\n", check.rows_trusted, check.rows_doubted);
  for (const JointCheck& joint : check.joints) {
    const core::DisplayUnit unit = core::display_unit(joint.unit);
    text +=
        fmt::format("  {:<12} largest difference {:.3g} {}, where inputs are clamped {:.3g} {}\n",
                    joint.joint, joint.largest_difference * unit.per_si, unit.name,
                    joint.largest_clamped_difference * unit.per_si, unit.name);
    const auto change = joint.rmse_change_percent();
    if (!change) continue;
    const bool above = !(*change <= limit_percent);
    text +=
        fmt::format("  {:<12} RMSE {:.4g} {} in f32, {:.4g} {} as packed: {:+.3f} %{}\n", "",
                    *joint.model_rmse * unit.per_si, unit.name, *joint.weights_rmse * unit.per_si,
                    unit.name, *change, above ? fmt::format(", above {:g} %", limit_percent) : "");
    if (joint.is_worse_than_raw()) {
      text += learn::worse_than_raw(joint.joint, joint.unit, *joint.weights_rmse, *joint.raw_rmse) +
              "\n";
    }
  }
  return text;
}

std::string text_of(const SourceCheck& check, const std::string& origin) {
  std::string text =
      fmt::format("source ({}): run beside the weights on {} random inputs{}\n", origin, check.rows,
                  check.samples > 1 ? fmt::format(", windows of {} samples", check.samples) : "");
  for (const SourceDifference& joint : check.joints) {
    const core::DisplayUnit unit = core::display_unit(joint.unit);
    text +=
        fmt::format("  {:<12} largest difference {:.3g} {}, {:.2g} of its spread of {:.3g} {}\n",
                    joint.joint, joint.largest * unit.per_si, unit.name,
                    joint.spread > 0.0 ? joint.largest / joint.spread : 0.0,
                    joint.spread * unit.per_si, unit.name);
  }
  return text;
}

std::string why_not_written(const Request& request, const Outcome& outcome) {
  if (outcome.is_unstable) {
    return fmt::format(
        "{} is not written: the margins of the loop through correction and servo are too small, so "
        "the arm may oscillate; train with --features light-open or --loop-noise (--unbounded-loop "
        "writes it all the same)\n",
        request.out);
  }
  if (outcome.is_other) {
    return fmt::format(
        "{} is not written: the weights do not compute what {} does; please report it\n",
        request.out, request.model);
  }
  if (outcome.is_worse) {
    return fmt::format(
        "{} is not written: {} makes errors larger on {} than no correction does. {} (without "
        "--check it is written all the same)\n",
        request.out, request.model, request.check,
        outcome.foreign
            ? fmt::format("Look at the order of the features, the units, the scaling and the sign "
                          "(truth - estimate) in {}",
                          request.scaling)
            : "Train with recordings that are like this one");
  }
  return fmt::format("{} is not written: it costs too much accuracy (--max-rmse-change); {}\n",
                     request.out,
                     request.precision == "int8"   ? "--precision bf16 rounds weights less"
                     : request.precision == "bf16" ? "--precision f32 rounds no weight"
                                                   : "give --compact a smaller budget");
}

}  // namespace

std::string describe(const Request& request, const Outcome& outcome) {
  std::string text;
  if (outcome.calibration_rows > 0) {
    text += fmt::format("calibrated on {}, {} rows\n", fmt::join(request.calibration_files(), ", "),
                        outcome.calibration_rows);
  }
  if (request.compact) {
    text += fmt::format(
        "compact: {} of {} inputs, {} of {} weights; outputs change by {:.3g} % of their "
        "spread\n",
        outcome.compacted.kept_inputs.size(), outcome.model.features.size(),
        outcome.compacted.weights_after, outcome.compacted.weights_before,
        100.0 * outcome.compacted.output_change);
  }
  if (outcome.source_check) {
    text += text_of(*outcome.source_check, outcome.foreign->model.origin);
    if (!outcome.model.trust) {
      text +=
          "no joint trust region (the plugin judges inputs one by one only): --calibrate with the "
          "recordings of the training fits one\n";
    }
  }
  if (outcome.check) {
    text += text_of(*outcome.check, request.max_rmse_change_percent);
  } else if (!request.is_exact()) {
    text += fmt::format("not checked: --check RECORDING shows what {} costs\n",
                        request.precision == "f32" ? "--compact" : request.precision);
  }
  text += model::loop_text(outcome.compacted.model);
  if (outcome.margins) text += loop::describe(*outcome.margins);
  if (!outcome.accepted) return text + why_not_written(request, outcome);
  text += fmt::format("origin: {}\n", describe(outcome.model.origin));
  text += fmt::format(
      "{}: {} bytes, {}, {} inputs, {} outputs; {} bytes per step, 1/{:.3g} of f32\n", request.out,
      outcome.blob.size(), request.precision, outcome.compacted.model.features.size(),
      outcome.model.outputs.size(), outcome.bytes_per_step,
      static_cast<double>(outcome.f32_bytes_per_step) /
          static_cast<double>(outcome.bytes_per_step));
  text += fmt::format("self-test passed by the code for {}\n", fmt::join(outcome.kernels, ", "));
  return text;
}

std::string to_json(const Request& request, const Outcome& outcome) {
  nlohmann::ordered_json json;
  json["weights"] = request.out;
  json["written"] = outcome.accepted;
  json["precision"] = request.precision;
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
    for (const SourceDifference& joint : outcome.source_check->joints) {
      json["source"]["joints"].push_back({{"joint", joint.joint},
                                          {"unit", joint.unit},
                                          {"largest_difference", joint.largest},
                                          {"spread", joint.spread}});
    }
  }
  json["calibration_rows"] = outcome.calibration_rows;
  json["inputs"] = outcome.compacted.model.features.size();
  json["bytes_per_step"] = outcome.bytes_per_step;
  json["bytes_per_step_f32"] = outcome.f32_bytes_per_step;
  if (request.compact) {
    json["compact"] = {{"budget", request.budget},
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
    for (const JointCheck& joint : outcome.check->joints) {
      nlohmann::ordered_json item = {
          {"joint", joint.joint},
          {"unit", joint.unit},
          {"largest_difference", joint.largest_difference},
          {"largest_clamped_difference", joint.largest_clamped_difference}};
      if (const auto change = joint.rmse_change_percent()) {
        item["model_rmse"] = *joint.model_rmse;
        item["weights_rmse"] = *joint.weights_rmse;
        item["rmse_change_percent"] = *change;
        item["raw_rmse"] = *joint.raw_rmse;
        item["worse_than_raw"] = joint.is_worse_than_raw();
      }
      json["check"]["joints"].push_back(std::move(item));
    }
  }
  return json.dump(2) + "\n";
}

}  // namespace ravencal::conversion
