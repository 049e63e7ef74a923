// SPDX-License-Identifier: Apache-2.0
//
// The options of a network and of its training that train, ablate and compare share. What they fill
// holds their defaults.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <vector>

#include "model/kinds.hpp"

namespace ravencal::commands {

/// --hidden: widths of the hidden layers, e.g. 128,64,32.
void add_hidden_option(CLI::App& command, std::vector<std::uint32_t>& hidden);
/// The same, where `none` stands for no hidden layer: linear regression.
void add_hidden_or_none_option(CLI::App& command, std::vector<std::uint32_t>& hidden);

/// --activation
void add_activation_option(CLI::App& command, model::Activation& activation);

/// --epochs and --batch
void add_epoch_options(CLI::App& command, std::uint32_t& epochs, std::uint32_t& batch);

/// --learning-rate
void add_learning_rate_option(CLI::App& command, double& learning_rate);

/// --networks
void add_networks_option(CLI::App& command, std::uint32_t& networks);

/// --joints
void add_joints_option(CLI::App& command, std::vector<std::string>& joints);

}  // namespace ravencal::commands
