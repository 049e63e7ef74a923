// SPDX-License-Identifier: Apache-2.0
//
// Recordings of two joints and what is asked of them, for the tests of what comes into diagnose.
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>
#include <cmath>
#include <limits>
#include <optional>
#include "diagnose/diagnose.hpp"
#include "diagnose/explain/parts.hpp"
#include "diagnose/explain/view.hpp"
#include "diagnose/track/tracks.hpp"
#include "diagnose_generator.hpp"

namespace ravencal::input_sample {

using diagnose::Channel;
using diagnose::ChannelKind;
using diagnose::Likelihood;
using diagnose::Tracks;
using Eigen::VectorXd;
using generator::make_recording;
using record::Recording;
using record::Role;

inline constexpr double kLength_s = 60.0;

inline physics::Plant plant_of(const std::string& text) {
  auto plant = physics::parse_plant(text, "plant.toml");
  EXPECT_TRUE(plant.ok()) << plant.error().message;
  return *plant;
}
/// Encoders that tell slow motion from rest.
inline constexpr const char* kSensors = "\n[sensors]\nmotor_encoder_counts_per_rev = 1e6\n";

inline physics::Plant two_joints(const std::string& effects = {}) {
  return plant_of(generator::plant_text(effects) + kSensors);
}

inline Recording named(const std::string& name, generator::Scene scene = {},
                       const generator::HiddenPhysics& hidden = {}) {
  scene.duration_s = kLength_s;
  Recording recording = make_recording(hidden, scene);
  recording.source = "folder/" + name;
  return recording;
}

inline void add_channel(Recording& recording, record::Channel channel, const VectorXd& values) {
  recording.channels.push_back(std::move(channel));
  recording.samples.conservativeResize(Eigen::NoChange, recording.samples.cols() + 1);
  recording.samples.col(recording.samples.cols() - 1) = values;
}

inline core::Result<Tracks> tracks_of(const std::vector<Recording>& training,
                                      const physics::Plant& plant,
                                      std::optional<double> held_out_from_s = {},
                                      const std::vector<Recording>& held_out = {}) {
  return diagnose::make_tracks(training, held_out, plant, held_out_from_s);
}

/// All notes of an explanation, before it looks for one.
inline std::string notes_of(const std::vector<Recording>& training, const physics::Plant& plant,
                            std::optional<double> held_out_from_s = {},
                            const std::vector<Recording>& held_out = {}) {
  auto tracks = tracks_of(training, plant, held_out_from_s, held_out);
  if (!tracks.ok()) return "refused: " + tracks.error().message;
  const Likelihood fitted(plant, std::move(tracks->training));
  std::optional<Likelihood> shown;
  if (!tracks->held_out.empty()) shown.emplace(plant, std::move(tracks->held_out), &fitted);
  diagnose::add_channel_notes(fitted, shown ? &*shown : nullptr,
                              diagnose::in_order(training, held_out), plant, tracks->notes);
  return fmt::format("{}", fmt::join(tracks->notes, "\n"));
}

inline void expect_words(const std::string& text, const std::vector<std::string>& words) {
  for (const std::string& word : words)
    EXPECT_NE(text.find(word), std::string::npos) << "wanted: " << word << "\nin: " << text;
}

}  // namespace ravencal::input_sample
