// SPDX-License-Identifier: Apache-2.0
#include "commands/network_options.hpp"
#include "cli/numbers.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "learn/network_limits.hpp"

namespace ravencal::commands {
namespace {

constexpr const char* kHidden = "--hidden";

std::vector<std::uint32_t> widths_of(const std::string& text) {
  std::vector<std::uint32_t> widths;
  for (const std::string& word : CLI::detail::split(text, ',')) {
    std::uint32_t width = 0;
    if (!CLI::detail::lexical_cast(word, width) || width == 0 || width > learn::kWidestLayer) {
      throw CLI::ValidationError(
          kHidden, fmt::format("'{}' is not a layer width of 1 to {}; write e.g. 128,64,32", word,
                               learn::kWidestLayer));
    }
    widths.push_back(width);
  }
  return widths;
}

void add_hidden(CLI::App& command, std::vector<std::uint32_t>& hidden, bool may_be_none,
                const char* description) {
  const auto take = [&hidden, may_be_none](const std::string& text) {
    hidden = may_be_none && text == "none" ? std::vector<std::uint32_t>() : widths_of(text);
  };
  command.add_option_function<std::string>(kHidden, take, description)
      ->default_str(fmt::format("{}", fmt::join(hidden, ",")));
}

}  // namespace

void add_hidden_option(CLI::App& command, std::vector<std::uint32_t>& hidden) {
  add_hidden(command, hidden, false, "Hidden layers of the network");
}

void add_hidden_or_none_option(CLI::App& command, std::vector<std::uint32_t>& hidden) {
  add_hidden(command, hidden, true, "Hidden layers of the network; none: linear regression");
}

void add_activation_option(CLI::App& command, model::Activation& activation) {
  command
      .add_option_function<std::string>(
          "--activation",
          [&activation](const std::string& name) {
            activation = name == "tanh"   ? model::Activation::kTanh
                         : name == "relu" ? model::Activation::kRelu
                                          : model::Activation::kSigmoid;
          },
          "Activation of the hidden layers")
      ->check(CLI::IsMember({"sigmoid", "tanh", "relu"}))
      ->default_str("sigmoid");
}

void add_epoch_options(CLI::App& command, std::uint32_t& epochs, std::uint32_t& batch) {
  command.add_option("--epochs", epochs, "Passes of the network over the recordings")
      ->check(CLI::Range(1U, learn::kMostEpochs))
      ->capture_default_str();
  command.add_option("--batch", batch, "Rows per step of the network")
      ->check(CLI::Range(1U, learn::kLargestBatch))
      ->capture_default_str();
}

void add_learning_rate_option(CLI::App& command, double& learning_rate) {
  command
      .add_option("--learning-rate", learning_rate, "Step size of the network's optimiser, Adam")
      ->check(cli::positive())
      ->capture_default_str();
}

void add_networks_option(CLI::App& command, std::uint32_t& networks) {
  command
      .add_option("--networks", networks,
                  "Networks of different seeds, averaged into one that is as many times wider")
      ->check(CLI::Range(1U, 100U))
      ->capture_default_str();
}

void add_joints_option(CLI::App& command, std::vector<std::string>& joints) {
  command.add_option("--joints", joints, "Joints to correct; without it all that have a truth")
      ->delimiter(',');
}

}  // namespace ravencal::commands
