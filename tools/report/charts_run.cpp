// SPDX-License-Identifier: Apache-2.0
//
// Charts of a training run and of a real-time run.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "report/charts.hpp"
#include "report/vega_spec.hpp"

namespace ravencal::report {
namespace {

/// Loss by epoch; what is not positive or finite is missing on a logarithmic axis.
json loss_data(const std::string& name, const std::vector<double>& loss) {
  json rows = json::array();
  for (std::size_t i = 0; i < loss.size(); ++i) {
    const bool drawable = std::isfinite(loss[i]) && loss[i] > 0;
    rows.push_back({{"epoch", i + 1}, {"loss", drawable ? json(loss[i]) : json(nullptr)}});
  }
  return {{"name", name}, {"values", std::move(rows)}};
}

json kept_epochs(json values) { return {{"name", "kept"}, {"values", std::move(values)}}; }

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

}  // namespace

json loss_chart(std::span<const LossCurve> losses, const std::string& unit) {
  constexpr double kWidth = 1020;
  constexpr double kHeight = 230;
  json spec = chart("training and validation loss by epoch", kWidth, kHeight);
  double least = std::numeric_limits<double>::infinity();
  double greatest = 0.0;
  std::size_t epochs = 1;
  json kept = json::array();
  for (std::size_t i = 0; i < losses.size(); ++i) {
    const LossCurve& run = losses[i];
    const std::string train = fmt::format("train{}", i);
    const std::string validation = fmt::format("validation{}", i);
    spec["data"].push_back(loss_data(train, run.train));
    spec["data"].push_back(loss_data(validation, run.validation));
    spec["marks"].push_back(
        line_mark(train, "epoch", "loss", {kCorrectedColour, 1.2, "", "linear"}));
    spec["marks"].push_back(
        line_mark(validation, "epoch", "loss", {kRawColour, 1.2, "[5,2]", "linear"}));
    epochs = std::max({epochs, run.train.size(), run.validation.size()});
    for (const auto* values : {&run.train, &run.validation}) {
      for (const double loss : *values) {
        if (!std::isfinite(loss) || !(loss > 0)) continue;
        least = std::min(least, loss);
        greatest = std::max(greatest, loss);
      }
    }
    const auto& marked = run.validation.empty() ? run.train : run.validation;
    if (run.kept_epoch && *run.kept_epoch >= 1 && *run.kept_epoch <= marked.size()) {
      const double loss = marked[*run.kept_epoch - 1];
      if (std::isfinite(loss) && loss > 0) {
        kept.push_back({{"epoch", *run.kept_epoch},
                        {"loss", loss},
                        {"text", fmt::format("{}: epoch {} kept, loss {:.4g}", run.name,
                                             *run.kept_epoch, loss)}});
      }
    }
  }
  if (!(greatest > 0)) least = greatest = 1.0;
  spec["data"].push_back(kept_epochs(std::move(kept)));
  spec["marks"].push_back(kept_mark());
  const Extent range = {least / 1.2, greatest * 1.2};
  spec["scales"] = {
      scale("x", "linear", {1.0, static_cast<double>(std::max<std::size_t>(epochs, 2))}, 0, kWidth),
      scale("y", "log", range, kHeight, 0)};
  json y_axis = axis("left", "y", fmt::format("loss [{}]", unit));
  y_axis["format"] = "~g";
  y_axis["values"] = log_ticks(range);
  spec["axes"] = {axis("bottom", "x", "epoch"), std::move(y_axis)};
  return spec;
}

json duration_chart(std::span<const DurationBin> bins, const std::string& what, double period_ns) {
  constexpr double kWidth = 460;
  constexpr double kHeight = 180;
  constexpr double kNsPerUs = 1e3;
  json spec = chart(what + ": number of ticks by duration", kWidth, kHeight);
  double from = std::numeric_limits<double>::infinity();
  double to = 0.0;
  double most = 1.0;
  json rows = json::array();
  for (const DurationBin& bin : bins) {
    if (bin.count == 0) continue;
    // A bin that starts at zero has no place on a logarithmic axis: it is drawn from a tenth of its
    // end.
    const double begin_us = std::max(bin.from_ns, bin.to_ns / 10) / kNsPerUs;
    const double end_us = bin.to_ns / kNsPerUs;
    rows.push_back({{"begin", begin_us}, {"end", end_us}, {"count", bin.count}});
    from = std::min(from, begin_us);
    to = std::max(to, end_us);
    most = std::max(most, static_cast<double>(bin.count));
  }
  if (!(to > from)) {
    from = 1;
    to = 10;
  }
  const double period_us = period_ns / kNsPerUs;
  if (to > period_us / 10) to = std::max(to, 1.1 * period_us);
  spec["data"] = {{{"name", "bins"}, {"values", std::move(rows)}}};
  spec["scales"] = {scale("x", "log", {from, to}, 0, kWidth),
                    scale("y", "log", {0.5, 1.4 * most}, kHeight, 0)};
  json x_axis = axis("bottom", "x", what + " [µs]");
  x_axis["format"] = "~g";
  x_axis["values"] = log_ticks({from, to});
  json y_axis = axis("left", "y", "ticks");
  y_axis["values"] = {1, 10, 100, 1000, 10000, 100000, 1000000, 10000000};
  y_axis["format"] = "~s";
  spec["axes"] = {std::move(x_axis), std::move(y_axis)};
  spec["marks"].push_back(
      {{"type", "rect"},
       {"from", {{"data", "bins"}}},
       {"encode",
        {{"enter",
          {{"x", {{"scale", "x"}, {"field", "begin"}}},
           {"x2", {{"scale", "x"}, {"field", "end"}}},
           {"y", {{"scale", "y"}, {"field", "count"}}},
           {"y2", {{"value", kHeight}}},
           {"fill", {{"value", kCorrectedColour}}},
           {"tooltip",
            {{"signal",
              "format(datum.begin, '.3~g') + ' to ' + format(datum.end, '.3~g') + ' µs: ' + "
              "format(datum.count, ',d') + ' ticks'"}}}}}}}});
  if (period_us >= from && period_us <= to) {
    spec["marks"].push_back({{"type", "rule"},
                             {"encode",
                              {{"enter",
                                {{"x", {{"scale", "x"}, {"value", period_us}}},
                                 {"y", {{"value", 0}}},
                                 {"y2", {{"value", kHeight}}},
                                 {"stroke", {{"value", kRawColour}}},
                                 {"strokeDash", {{"value", json::array({4, 3})}}},
                                 {"strokeWidth", {{"value", 1.5}}}}}}}});
  }
  return spec;
}

}  // namespace ravencal::report
