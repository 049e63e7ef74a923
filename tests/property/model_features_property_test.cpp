// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/catalogue.hpp"
#include "model/feature_matrix.hpp"
#include "model/feature_spec.hpp"

namespace ravencal::model {
namespace {

std::vector<record::Channel> catalogue_channels() {
  std::vector<record::Channel> channels;
  for (const core::CatalogueEntry& entry : core::catalogue()) {
    channels.push_back({entry.name, entry.si_unit, record::Role::kFeature, ""});
  }
  return channels;
}

FeatureSpec arbitrary_feature() {
  FeatureSpec feature;
  feature.channel = core::catalogue()[*rc::gen::inRange<std::size_t>(0, core::kCatalogueSize)].name;
  feature.transform =
      *rc::gen::element(Transform::kValue, Transform::kLag, Transform::kPlay, Transform::kMean,
                        Transform::kMeanOfAbs, Transform::kTravelMean, Transform::kTravelMeanOfAbs);
  if (feature.transform == Transform::kLag) feature.lag_rows = *rc::gen::inRange(1U, 100000U);
  if (feature.transform == Transform::kPlay) {
    feature.play_half_width =
        std::ldexp(static_cast<float>(*rc::gen::inRange(1, 1 << 24)), *rc::gen::inRange(-60, 10));
  }
  if (is_mean(feature.transform)) {
    feature.time_constant_s = 1e-6F * static_cast<float>(*rc::gen::inRange(1000, 1'000'000'000));
    RC_PRE(is_time_constant(feature.time_constant_s));
  }
  if (is_travel_mean(feature.transform)) {
    feature.travel_si = 1e-6F * static_cast<float>(*rc::gen::inRange(1, 1'000'000'000));
    RC_PRE(is_travel(feature.travel_si));
    feature.along = core::catalogue()[*rc::gen::inRange<std::size_t>(0, core::kCatalogueSize)].name;
  }
  return feature;
}

RC_GTEST_PROP(FeatureSpec, ReadsWhatItWrites, ()) {
  const FeatureSpec feature = arbitrary_feature();
  const auto read = FeatureSpec::parse(feature.text());
  RC_ASSERT(read.ok());
  RC_ASSERT(*read == feature);
}

RC_GTEST_PROP(FeatureSpec, AcceptsOrRefusesAnyTextAndKeepsWhatItAccepts, ()) {
  const auto text =
      *rc::gen::container<std::string>(rc::gen::elementOf(std::string("abs.*@~%:0159-+e")));
  const auto read = FeatureSpec::parse(text);
  if (!read.ok()) return;
  const auto again = FeatureSpec::parse(read->text());
  RC_ASSERT(again.ok());
  RC_ASSERT(*again == *read);
}

RC_GTEST_PROP(FeatureSelection, GivesExactlyTheFeaturesOfAListOfThem, ()) {
  std::vector<FeatureSpec> features;
  std::string text;
  const int count = *rc::gen::inRange(1, 12);
  for (int i = 0; i < count; ++i) {
    const FeatureSpec feature = arbitrary_feature();
    text += (i > 0 ? "," : "") + feature.text();
    if (std::find(features.begin(), features.end(), feature) == features.end()) {
      features.push_back(feature);
    }
  }
  const auto channels = catalogue_channels();
  const auto read = select_features(text, channels);
  RC_ASSERT(read.ok());
  RC_ASSERT(*read == features);
}

RC_GTEST_PROP(FeatureSelection, NeverRepeatsAFeatureAndNeverLeavesOneThatWasRemovedLast, ()) {
  const auto term = [] {
    return *rc::gen::element<std::string>("paper112", "light", "tau.*", "group:joint_pose",
                                          "joint:elbow", "*.wrist", "jpos.elbow@3", "mpos.*~0.01",
                                          "tau.*%0.5", "tau.elbow%abs0.5", "tau.*%0.1:jpos.elbow",
                                          "tau.elbow%abs0.1:jpos.elbow");
  };
  std::string text = term();
  const int count = *rc::gen::inRange(0, 6);
  for (int i = 0; i < count; ++i) text += (*rc::gen::arbitrary<bool>() ? ",-" : ",") + term();
  const std::string removed = term();
  const auto channels = catalogue_channels();
  const auto kept = select_features(text + ",-" + removed, channels);
  if (!kept.ok()) return;  // nothing left
  auto sorted = *kept;
  std::sort(sorted.begin(), sorted.end(),
            [](const auto& a, const auto& b) { return a.text() < b.text(); });
  RC_ASSERT(std::adjacent_find(sorted.begin(), sorted.end()) == sorted.end());
  const std::vector<FeatureSpec> gone = *select_features(removed, channels);
  for (const FeatureSpec& feature : gone) {
    RC_ASSERT(std::find(kept->begin(), kept->end(), feature) == kept->end());
  }
}

/// A play operator written down directly.
RC_GTEST_PROP(FeatureMatrix, KeepsPlayWithinItsHalfWidthAndMovesItOnlyWhenPushed, ()) {
  record::Recording recording;
  recording.channels = {{"x", "rad", record::Role::kFeature, ""}};
  const auto values =
      *rc::gen::nonEmpty(rc::gen::container<std::vector<int>>(rc::gen::inRange(-1000, 1000)));
  recording.samples.resize(static_cast<Eigen::Index>(values.size()), 1);
  for (std::size_t i = 0; i < values.size(); ++i) {
    recording.samples(static_cast<Eigen::Index>(i), 0) = values[i] * 0.125;
    recording.t_ns.push_back(static_cast<std::int64_t>(i));
  }
  const float half_width = 0.125F * static_cast<float>(*rc::gen::inRange(1, 400));
  const FeatureSpec features[] = {{"x", Transform::kPlay, 0, half_width}};
  const FeatureMatrix matrix = *feature_matrix(features, recording);
  auto state = static_cast<float>(recording.samples(0, 0));
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    const auto x = static_cast<float>(recording.samples(row, 0));
    state = std::clamp(state, x - half_width, x + half_width);
    RC_ASSERT(matrix(row, 0) == state);
  }
}

}  // namespace
}  // namespace ravencal::model
