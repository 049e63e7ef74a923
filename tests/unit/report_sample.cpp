// SPDX-License-Identifier: Apache-2.0
#include "unit/report_sample.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace ravencal::report {
namespace {

struct SampleJoint {
  const char* name;
  const char* unit;
  double centre, amplitude, period_s, bias, slack;
};
constexpr SampleJoint kJoints[] = {{"shoulder", "deg", 30, 18, 7.1, 1.2, 0.35},
                                   {"elbow", "deg", 75, 22, 5.3, -2.1, 0.5},
                                   {"insertion", "mm", -380, 45, 9.7, 0.4, 0.2}};

double triangle(double phase) {
  return 2 / std::numbers::pi * std::asin(std::sin(2 * std::numbers::pi * phase));
}

JointSeries series_of(const SampleJoint& joint, std::size_t samples) {
  std::mt19937_64 random(7);
  JointSeries series{joint.name, joint.unit, {}, {}, {}, {}, joint.bias, {}};
  double cable = joint.centre;
  for (std::size_t i = 0; i < samples; ++i) {
    const double t_s = 0.01 * static_cast<double>(i);
    const double truth = joint.centre + joint.amplitude * triangle(t_s / joint.period_s);
    const double noise = 0.02 * (static_cast<double>(random() >> 11) * 0x1p-53 - 0.5);
    cable = std::clamp(cable, truth - joint.slack, truth + joint.slack);
    series.t_s.push_back(t_s);
    series.truth.push_back(truth);
    series.raw.push_back(cable + joint.bias + noise);
    series.corrected.push_back(truth + 0.1 * (cable - truth) + noise);
  }
  return series;
}

ErrorFigure figure_of(const JointSeries& series, const std::vector<double>& estimate, double bias) {
  double squares = 0.0;
  ErrorFigure figure{0.0, 0.0};
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const double error = estimate[i] - series.truth[i] - bias;
    squares += error * error;
    figure.peak = std::max(figure.peak, std::abs(error));
  }
  figure.rmse = std::sqrt(squares / static_cast<double>(estimate.size()));
  return figure;
}

RealTimeFigures real_time_figures() {
  RealTimeFigures figures;
  figures.ticks = 1000;
  figures.wakeup_ns = {3200, 9800, 14000, 61000};
  figures.step_ns = {41000, 44000, 52000, 93000};
  figures.wakeup_histogram = {{0, 2000, 100}, {2000, 8000, 880}, {8000, 64000, 20}};
  figures.step_histogram = {{32000, 64000, 990}, {64000, 128000, 10}};
  return figures;
}

}  // namespace

CalibrationReport sample_report(std::size_t samples) {
  CalibrationReport report;
  report.title = "Calibration of the left arm";
  report.subtitle = "a made-up zig-zag";
  report.verdict = "The calibration cuts the error of every joint.";
  report.provenance = {{"seed", "7"}};
  report.reproduce = "ravencal evaluate model.onnx held_out.db";
  ErrorTable table{"held out", "a note", "a paper", {}};
  for (const SampleJoint& joint : kJoints) {
    JointSeries series = series_of(joint, samples);
    table.rows.push_back({joint.name, joint.unit, samples, figure_of(series, series.raw, 0),
                          figure_of(series, series.raw, joint.bias),
                          figure_of(series, series.corrected, 0), ErrorFigure{0.5, kUnknown}});
    report.series.push_back(std::move(series));
  }
  report.tables.push_back(std::move(table));
  report.map_x_joint = "elbow";
  report.map_y_joint = "insertion";
  LossCurve run{"seed 7", {}, {}, 40};
  for (int epoch = 0; epoch < 50; ++epoch) {
    run.train.push_back(std::exp(-0.1 * epoch));
    run.validation.push_back(std::exp(-0.1 * epoch) + 0.01);
  }
  report.losses = {run};
  report.real_time = real_time_figures();
  return report;
}

}  // namespace ravencal::report
