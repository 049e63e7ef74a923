// SPDX-License-Identifier: Apache-2.0
//
// Charts of a training run and of a real-time run.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "core/constants.hpp"
#include "report/charts.hpp"
#include "report/vega_spec.hpp"

namespace ravencal::report {
namespace {

/// Loss by epoch; what is not positive or finite is missing on a logarithmic axis.
json loss_data(const std::string& name, const std::vector<double>& loss) {
  std::vector<double> epochs, drawable;
  for (std::size_t i = 0; i < loss.size(); ++i) {
    epochs.push_back(static_cast<double>(i + 1));
    drawable.push_back(loss[i] > 0 ? loss[i] : kUnknown);
  }
  return significant_data(name, {{"epoch", std::move(epochs)}, {"loss", std::move(drawable)}});
}

/// Least and greatest positive loss of all runs, with a margin.
Extent loss_range(std::span<const LossCurve> losses) {
  double least = std::numeric_limits<double>::infinity();
  double greatest = 0.0;
  const auto widen = [&](const std::vector<double>& values) {
    for (const double loss : values) {
      if (!std::isfinite(loss) || loss <= 0) continue;
      least = std::min(least, loss);
      greatest = std::max(greatest, loss);
    }
  };
  for (const LossCurve& run : losses) {
    widen(run.train);
    widen(run.validation);
  }
  constexpr double kMargin = 1.2;
  return greatest > 0 ? Extent{least / kMargin, greatest * kMargin} : Extent{0.1, 10};
}

/// The kept epoch of each run that has one with a loss that can be drawn.
json kept_data(std::span<const LossCurve> losses) {
  json rows = json::array();
  for (const LossCurve& run : losses) {
    const auto& marked = run.validation.empty() ? run.train : run.validation;
    const std::size_t epoch = run.kept_epoch.value_or(0);
    if (epoch < 1 || epoch > marked.size()) continue;
    const double loss = marked[epoch - 1];
    if (!std::isfinite(loss) || loss <= 0) continue;
    const std::string text = fmt::format("{}: epoch {} kept, loss {:.4g}", run.name, epoch, loss);
    rows.push_back({{"epoch", epoch}, {"loss", loss}, {"text", text}});
  }
  return {{"name", "kept"}, {"values", std::move(rows)}};
}

json kept_mark() {
  return {{"type", "symbol"},
          {"from", {{"data", "kept"}}},
          {"encode",
           {{"enter",
             {{"x", {{"scale", "x"}, {"field", "epoch"}}},
              {"y", {{"scale", "y"}, {"field", "loss"}}},
              {"size", {{"value", 60}}},
              {"fill", {{"value", "var(--paper)"}}},
              {"stroke", {{"value", kInkColour}}},
              {"strokeWidth", {{"value", 1.5}}},
              {"tooltip", {{"signal", "datum.text"}}}}}}}};
}

constexpr double kDurationWidth = 460;
constexpr double kDurationHeight = 180;

json duration_bars() {
  const char* tooltip =
      "format(datum.begin, '.3~g') + ' to ' + format(datum.end, '.3~g') + ' µs: ' + "
      "format(datum.count, ',d') + ' ticks'";
  return {{"type", "rect"},
          {"from", {{"data", "bins"}}},
          {"encode",
           {{"enter",
             {{"x", {{"scale", "x"}, {"field", "begin"}}},
              {"x2", {{"scale", "x"}, {"field", "end"}}},
              {"y", {{"scale", "y"}, {"field", "count"}}},
              {"y2", {{"value", kDurationHeight}}},
              {"fill", {{"value", kCorrectedColour}}},
              {"tooltip", {{"signal", tooltip}}}}}}}};
}

json period_rule(double period_us) {
  return {{"type", "rule"},
          {"encode",
           {{"enter",
             {{"x", {{"scale", "x"}, {"value", period_us}}},
              {"y", {{"value", 0}}},
              {"y2", {{"value", kDurationHeight}}},
              {"stroke", {{"value", kRawColour}}},
              {"strokeDash", {{"value", json::array({4, 3})}}},
              {"strokeWidth", {{"value", 1.5}}}}}}}};
}

}  // namespace

json loss_chart(std::span<const LossCurve> losses, const std::string& unit) {
  constexpr double kWidth = 1020;
  constexpr double kHeight = 230;
  json spec = chart("training and validation loss by epoch", kWidth, kHeight);
  std::size_t epochs = 2;
  for (std::size_t i = 0; i < losses.size(); ++i) {
    const std::string train = fmt::format("train{}", i);
    const std::string validation = fmt::format("validation{}", i);
    spec["data"].push_back(loss_data(train, losses[i].train));
    spec["data"].push_back(loss_data(validation, losses[i].validation));
    spec["marks"].push_back(
        line_mark(train, "epoch", "loss", {kCorrectedColour, 1.2, "", "linear"}));
    spec["marks"].push_back(
        line_mark(validation, "epoch", "loss", {kRawColour, 1.2, "[5,2]", "linear"}));
    epochs = std::max(epochs, losses[i].train.size());
  }
  spec["data"].push_back(kept_data(losses));
  spec["marks"].push_back(kept_mark());
  const Extent range = loss_range(losses);
  spec["scales"] = {scale("x", "linear", {1.0, static_cast<double>(epochs)}, 0, kWidth),
                    scale("y", "log", range, kHeight, 0)};
  json y_axis = axis("left", "y", fmt::format("loss [{}]", unit));
  y_axis["format"] = "~g";
  y_axis["values"] = log_ticks(range);
  spec["axes"] = {axis("bottom", "x", "epoch"), std::move(y_axis)};
  return spec;
}

json duration_chart(std::span<const DurationBin> bins, const std::string& what, double period_ns) {
  json spec = chart(what + ": number of ticks by duration", kDurationWidth, kDurationHeight);
  Extent range = {std::numeric_limits<double>::infinity(), 0.0};
  double most = 1.0;
  json rows = json::array();
  for (const DurationBin& bin : bins) {
    if (bin.count == 0) continue;
    // A logarithmic axis has no zero: a bin that starts there is drawn from a tenth of its end.
    const double begin_us = std::max(bin.from_ns, bin.to_ns / 10) / core::kNsPerUs;
    const double end_us = bin.to_ns / core::kNsPerUs;
    rows.push_back({{"begin", begin_us}, {"end", end_us}, {"count", bin.count}});
    range = {std::min(range.from, begin_us), std::max(range.to, end_us)};
    most = std::max(most, static_cast<double>(bin.count));
  }
  if (!(range.to > range.from)) range = {1.0, 10.0};
  const double period_us = period_ns / core::kNsPerUs;
  if (range.to > period_us / 10) range.to = std::max(range.to, 1.1 * period_us);
  spec["data"] = json::array({{{"name", "bins"}, {"values", std::move(rows)}}});
  spec["scales"] = {scale("x", "log", range, 0, kDurationWidth),
                    scale("y", "log", {0.5, 1.4 * most}, kDurationHeight, 0)};
  json x_axis = axis("bottom", "x", what + " [µs]");
  x_axis["format"] = "~g";
  x_axis["values"] = log_ticks(range);
  json y_axis = axis("left", "y", "ticks");
  y_axis["values"] = log_ticks({1.0, 1.4 * most});
  y_axis["format"] = "~s";
  spec["axes"] = {std::move(x_axis), std::move(y_axis)};
  spec["marks"].push_back(duration_bars());
  if (period_us >= range.from && period_us <= range.to) {
    spec["marks"].push_back(period_rule(period_us));
  }
  return spec;
}

}  // namespace ravencal::report
