// SPDX-License-Identifier: Apache-2.0
//
// Where a model comes from: of which arm and robot its recordings are, how the robot was controlled
// meanwhile, and in which coordinates its inputs were. Weights of another arm correct wrongly.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/result.hpp"
#include "model/kinds.hpp"

namespace ravencal::model {

struct Origin {
  Arm arm = Arm::kUnknown;
  Coordinates coordinates = Coordinates::kUnknown;
  std::string robot;       ///< its name; empty: unknown
  std::string controller;  ///< branch or control mode, e.g. "crtk"; empty: unknown
  friend bool operator==(const Origin&, const Origin&) = default;
};

/// "gold", "green", "motor", "corrected"; "unknown".
std::string_view name_of(Arm arm);
std::string_view name_of(Coordinates coordinates);
/// The value of that name; none for other texts.
std::optional<Arm> arm_from(std::string_view name);
std::optional<Coordinates> coordinates_from(std::string_view name);

/// In words, e.g. "gold arm of RAVEN-II, controller crtk, inputs in motor coordinates".
std::string describe(const Origin& origin);

/// The values of `known`, completed by those of `more`. Errors (kData): the two disagree; the
/// sentence begins with `source`, where `more` comes from, e.g. "run2.db".
core::Result<Origin> joined(const Origin& known, const Origin& more, std::string_view source);

}  // namespace ravencal::model
