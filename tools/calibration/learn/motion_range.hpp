// SPDX-License-Identifier: Apache-2.0
//
// How fast joints move and how hard their drives push, row by row, and which of that a training
// showed: a model says little about errors at speeds and loads that no training row had.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "model/calibration_model.hpp"
#include "record/recording.hpp"

namespace ravencal::learn {

using RowFlags = Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>;

/// Drive torque of the joint, else its drive input; nothing if neither is recorded.
std::optional<Eigen::Index> effort_column(const record::Recording& recording,
                                          std::string_view joint);

/// Speed of every output's estimate, [rows x outputs], rad/s or m/s, signed. The difference of the
/// means over the 50 ms before and behind a row (and over two rows at least), so that an encoder
/// count is no speed. No window reaches over an event of kind "episode" or a gap of ten rows. NaN
/// where the recording lacks the estimate or time.
Eigen::MatrixXd joint_speeds(std::span<const model::OutputSpec> outputs,
                             const record::Recording& recording);

/// Effort of every output's joint (effort_column) in SI units, [rows x outputs]: the mean over the
/// same windows. NaN where there is none.
Eigen::MatrixXd joint_efforts(std::span<const model::OutputSpec> outputs,
                              const record::Recording& recording);

/// What a sensor behind the cables says of every output's joint (Role::kLoad), likewise.
Eigen::MatrixXd joint_loads(std::span<const model::OutputSpec> outputs,
                            const record::Recording& recording);

/// Of the rows of all recordings that have the truth of the joint.
model::MotionRange motion_range(std::span<const model::OutputSpec> outputs,
                                std::span<const record::Recording* const> training);

/// Rows whose speed or load is beyond the training's, [rows x outputs]: an eighth of the range's
/// width or more outside of it. Strokes back and forth at one speed have all their rows at the ends
/// of the range; beyond is what is faster by a quarter, and so adds a quarter to what viscous
/// friction does. An unknown speed or load is not beyond.
RowFlags beyond_motion(const model::MotionRange& range, std::span<const model::OutputSpec> outputs,
                       const record::Recording& recording);

}  // namespace ravencal::learn
