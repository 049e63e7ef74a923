// SPDX-License-Identifier: Apache-2.0
//
// Whether a recording's joints are its motors', told from the recording alone: on the twin's, and
// on the recording of a real RAVEN-II where it is at hand.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>

#include "learn/motor_coordinates.hpp"
#include "learn/recording_origin.hpp"

namespace ravencal::learn {
namespace {

using model::Coordinates;
constexpr std::array<const char*, 3> kNames = {"shoulder", "elbow", "insertion"};

record::Recording empty_recording(Eigen::Index rows) {
  record::Recording recording;
  recording.source = "R.db";
  for (const char* kind : {"jpos.", "mpos."}) {
    for (const char* name : kNames) {
      recording.channels.push_back({std::string(kind) + name, "rad", record::Role::kFeature, name});
    }
  }
  recording.samples.resize(rows, 6);
  for (Eigen::Index row = 0; row < rows; ++row) recording.t_ns.push_back(row * 10'000'000);
  return recording;
}

/// A RAVEN-II's coupling, in single precision as the controller has it; `share` of its range is
/// moved.
record::Recording coupled(double share) {
  record::Recording recording = empty_recording(500);
  for (Eigen::Index row = 0; row < recording.rows(); ++row) {
    const double t = 0.01 * static_cast<double>(row);
    const std::array<double, 3> motor = {68.0 + share * 30.0 * std::sin(3.1 * t),
                                         190.0 + share * 40.0 * std::sin(4.7 * t + 1.0),
                                         860.0 + share * 90.0 * std::cos(2.3 * t)};
    const double shoulder = motor[0] / 136.196;
    const double elbow = motor[1] / 121.522 - 0.14545 * shoulder;
    const double insertion = motor[2] / 2158.59 - 0.0078 * shoulder - 0.00808 * elbow;
    const std::array<double, 3> joint = {shoulder, elbow, insertion};
    for (Eigen::Index j = 0; j < 3; ++j) {
      const auto i = static_cast<std::size_t>(j);
      recording.samples(row, j) = static_cast<double>(static_cast<float>(joint[i]));
      recording.samples(row, 3 + j) = static_cast<double>(static_cast<float>(motor[i]));
    }
  }
  return recording;
}

TEST(MotorCoordinates, AreSeenOfAnyCouplingWithoutKnowingIt) {
  EXPECT_EQ(motor_coordinates(coupled(1.0)).coordinates, Coordinates::kMotor);
}

TEST(MotorCoordinates, AreNotThoseOfACorrectedRecording) {
  for (const double correction_rad : {-0.12, 0.021, 0.002}) {
    record::Recording constant = coupled(1.0);
    constant.samples.col(1).array() += correction_rad;
    EXPECT_EQ(motor_coordinates(constant).coordinates, Coordinates::kCorrected) << correction_rad;
    record::Recording half = coupled(1.0);  // armed half-way through
    half.samples.col(0).tail(250).array() += correction_rad;
    const MotorCoordinates seen = motor_coordinates(half);
    EXPECT_EQ(seen.coordinates, Coordinates::kCorrected) << correction_rad;
    EXPECT_GT(seen.unexplained_rad, 0.2 * std::fabs(correction_rad));
  }
}

TEST(MotorCoordinates, AreUnknownWhereNothingMovesOrAChannelIsMissing) {
  EXPECT_EQ(motor_coordinates(coupled(0.0)).coordinates, Coordinates::kUnknown);
  record::Recording no_motors = coupled(1.0);
  no_motors.channels[4].name = "other";
  EXPECT_EQ(motor_coordinates(no_motors).coordinates, Coordinates::kUnknown);
}

TEST(RecordingOrigin, RefusesToTrainOnWhatWasRecordedWhileCorrecting) {
  record::Recording recording = coupled(1.0);
  recording.meta["robot"] = "RAVEN-II";
  const std::array<const record::Recording*, 1> one = {&recording};
  ASSERT_TRUE(common_origin({}, one).ok());
  EXPECT_EQ(common_origin({}, one).value().coordinates, Coordinates::kMotor);
  recording.samples.col(1).array() -= 0.12;
  const auto refused = common_origin({}, one);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("while a correction was applied"), std::string::npos);
  recording.meta["coordinates"] = "motor";
  const auto denied = common_origin({}, one);
  ASSERT_FALSE(denied.ok());
  EXPECT_NE(denied.error().message.find("meta 'coordinates' is 'motor'"), std::string::npos);
}

TEST(MotorCoordinates, OfARealRavenAreItsMotors) {
  const std::filesystem::path path = RAVENCAL_DATA_DIR "/raven2_uiuc/raven2_joint123.csv";
  std::ifstream file(path);
  if (!file) GTEST_SKIP() << path << " is not there";
  record::Recording recording = empty_recording(19'415);
  std::string line;
  std::getline(file, line);  // t_s, jpos in deg, deg, cm, mpos in deg, ...
  constexpr double kDeg = std::numbers::pi / 180.0;
  for (Eigen::Index row = 0; std::getline(file, line); ++row) {
    ASSERT_LT(row, recording.rows());
    std::istringstream cells(line);
    std::string cell;
    std::getline(cells, cell, ',');
    for (Eigen::Index column = 0; column < 6; ++column) {
      std::getline(cells, cell, ',');
      recording.samples(row, column) = std::stod(cell) * (column == 2 ? 0.01 : kDeg);
    }
  }
  EXPECT_EQ(motor_coordinates(recording).coordinates, Coordinates::kMotor);
  recording.samples.col(0).array() += 0.5 * kDeg;
  EXPECT_EQ(motor_coordinates(recording).coordinates, Coordinates::kCorrected);
}

}  // namespace
}  // namespace ravencal::learn
