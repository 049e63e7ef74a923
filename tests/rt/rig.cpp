// SPDX-License-Identifier: Apache-2.0
#include "rt/rig.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <random>

#include "core/catalogue.hpp"
#include "core/run_level.hpp"
#include "model/blob_writer.hpp"
#include "plugin_host/robot_state.hpp"

namespace ravencal::test {
namespace {

/// Middle and half width of the range that make_model trains each channel on.
double middle_of(std::size_t catalogue_index) {
  return 0.25 + 0.01 * static_cast<double>(catalogue_index % 7);
}
constexpr double kHalfWidth = 0.5;

template <typename T>
T checked(core::Result<T> result) {
  if (!result.ok()) {
    ADD_FAILURE() << result.error().message;
    std::abort();  // nothing after this could mean anything
  }
  return std::move(result).value();
}

/// Integer channels are trained on integers, so that a state can hold the middle exactly.
bool is_integer(core::RavenField field) {
  using core::RavenField;
  return field == RavenField::kRunlevel || field == RavenField::kSublevel ||
         field == RavenField::kLastSeq || field == RavenField::kType ||
         field == RavenField::kEncVals || field == RavenField::kEncOffsets ||
         field == RavenField::kDac;
}

}  // namespace

model::FeatureSpec plain(const std::string& channel) { return {channel, model::Transform::kValue}; }

model::FeatureSpec lagged(const std::string& channel, std::uint32_t rows) {
  return {channel, model::Transform::kLag, rows};
}

model::FeatureSpec with_play(const std::string& channel, float half_width) {
  return {channel, model::Transform::kPlay, 0, half_width};
}

model::FeatureSpec mean_of(const std::string& channel, float time_constant_s) {
  return {channel, model::Transform::kMean, 0, 0.0F, time_constant_s};
}

model::FeatureSpec mean_of_abs(const std::string& channel, float time_constant_s) {
  return {channel, model::Transform::kMeanOfAbs, 0, 0.0F, time_constant_s};
}

model::FeatureSpec travel_mean_of(const std::string& channel, float travel_si,
                                  const std::string& position) {
  return {channel, model::Transform::kTravelMean, 0, 0.0F, 0.0F, travel_si, position};
}

model::FeatureSpec travel_mean_of_abs(const std::string& channel, float travel_si,
                                      const std::string& position) {
  return {channel, model::Transform::kTravelMeanOfAbs, 0, 0.0F, 0.0F, travel_si, position};
}

model::CalibrationModel make_model(const std::vector<model::FeatureSpec>& features,
                                   const std::vector<std::uint32_t>& hidden, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  const auto n = static_cast<Eigen::Index>(features.size());
  model::CalibrationModel model;
  model.features = features;
  model.input.mean.resize(n);
  model.input.scale = Eigen::VectorXd::Constant(n, kHalfWidth);
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& channel = features[static_cast<std::size_t>(i)].channel;
    const std::size_t index = *core::catalogue_index_of(channel);
    const bool integer = is_integer(core::catalogue()[index].field);
    model.input.mean[i] = integer ? 3.0 : middle_of(index);
  }
  model.input_min = model.input.mean.array() - kHalfWidth;
  model.input_max = model.input.mean.array() + kHalfWidth;
  std::vector<std::uint32_t> sizes{static_cast<std::uint32_t>(n)};
  sizes.insert(sizes.end(), hidden.begin(), hidden.end());
  sizes.push_back(RAVENCAL_JOINTS);
  for (std::size_t l = 0; l + 1 < sizes.size(); ++l) {
    model::DenseLayer layer;
    const float spread = std::sqrt(2.0F / static_cast<float>(sizes[l] + sizes[l + 1]));
    layer.weights = Eigen::MatrixXf::NullaryExpr(sizes[l + 1], sizes[l],
                                                 [&] { return spread * normal(random); });
    layer.biases =
        Eigen::VectorXf::NullaryExpr(sizes[l + 1], [&] { return 0.1F * normal(random); });
    layer.activation =
        l + 2 < sizes.size() ? model::Activation::kSigmoid : model::Activation::kLinear;
    model.layers.push_back(std::move(layer));
  }
  model.output.mean = Eigen::Vector3d(0.02, -0.05, 0.003);
  model.output.scale = Eigen::Vector3d(0.004, 0.004, 0.0004);
  model.outputs = {{"shoulder", "jpos.shoulder", "rad"},
                   {"elbow", "jpos.elbow", "rad"},
                   {"insertion", "jpos.insertion", "m"}};
  model.row_period_s = 0.01;
  model.provenance = {{"made_by", "tests"}};
  return model;
}

model::CalibrationModel make_model(std::uint32_t inputs, const std::vector<std::uint32_t>& hidden,
                                   std::uint64_t seed) {
  std::vector<model::FeatureSpec> features;
  // From index 1: time runs on, and would leave any range of 1 s.
  for (std::size_t i = 1; i < core::kCatalogueSize && features.size() < inputs; ++i) {
    features.push_back(plain(core::catalogue()[i].name));
  }
  return make_model(features, hidden, seed);
}

ravencal_state healthy_state(std::int64_t t_ns) {
  plugin_host::CatalogueValues values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = is_integer(core::catalogue()[i].field) ? 3.0 : middle_of(i);
  }
  ravencal_state state{};
  plugin_host::fill_state(values, t_ns, true, state);
  state.runlevel = core::kPedalUp;
  return state;
}

model::CalibrationModel make_model_with_a_flaw() {
  // Finite weights whose products cancel on the self-test's rows but overflow in a corner of the
  // trained range that none of them visits.
  model::CalibrationModel model = make_model({plain("jpos.shoulder"), plain("jpos.elbow")}, {2, 2});
  for (model::DenseLayer& layer : model.layers) layer.activation = model::Activation::kLinear;
  model.layers[0].weights << 1.8e38F, -1.8e38F, 0.0F, 0.0F;
  model.layers[0].biases.setZero();
  model.layers[1].weights << 2e-38F, 0.0F, 0.0F, 0.0F;
  model.layers[1].biases.setZero();
  return model;
}

void provoke_flaw(ravencal_state& state) {
  state.arm[0].jpos_ji[0] += 0.5F;
  state.arm[0].jpos_ji[1] -= 0.5F;
}

std::filesystem::path scratch_folder() {
  struct Folder {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("ravencal_test_" + std::to_string(::getpid()));
    Folder() { std::filesystem::create_directories(path); }
    ~Folder() {
      std::error_code ignored;
      std::filesystem::remove_all(path, ignored);
    }
  };
  static const Folder folder;
  return folder.path;
}

model::Packing packing_of(const model::CalibrationModel& model,
                          model::packed::Precision precision) {
  model::Packing packing{precision, {}};
  if (precision != model::packed::Precision::kInt8) return packing;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> uniform(0.0F, 1.0F);
  model::FeatureMatrix rows(200, static_cast<Eigen::Index>(model.features.size()));
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    for (Eigen::Index i = 0; i < rows.cols(); ++i) {
      const auto low = static_cast<float>(model.input_min[i]);
      const auto high = static_cast<float>(model.input_max[i]);
      rows(row, i) = low + (high - low) * uniform(random);
    }
  }
  packing.inputs = checked(model::measure_layer_inputs(model, rows));
  return packing;
}

std::filesystem::path write_weights(const model::CalibrationModel& model, const std::string& name,
                                    model::packed::Precision precision) {
  const std::filesystem::path path = scratch_folder() / (name + ".blob");
  const core::Status status = model::write_blob(model, path, packing_of(model, precision));
  EXPECT_TRUE(status.ok()) << (status.ok() ? "" : status.error().message);
  return path;
}

Rig::Rig(std::uint32_t max_isa)
    : Rig([&](ravencal_config& settings) { settings.max_isa = max_isa; }) {}

Rig::Rig(const std::function<void(ravencal_config&)>& configure)
    : library(checked(plugin_host::Library::open(RAVENCAL_PLUGIN_PATH))),
      config([&] {
        ravencal_config settings = library.default_config();
        // Tests share their machine: how long a step takes there decides nothing.
        settings.step_budget_ns = 0;
        // Random weights ask for any correction; tests of the cap set it.
        settings.cap_deviations = 0.0F;
        configure(settings);
        return settings;
      }()),
      instance(checked(plugin_host::Instance::create(library, config))),
      state(healthy_state()) {
  output.struct_size = sizeof output;
}

void Rig::load(const model::CalibrationModel& model, model::packed::Precision precision) {
  static int number = 0;
  const core::Status status =
      instance.load(write_weights(model, "rig" + std::to_string(++number), precision));
  ASSERT_TRUE(status.ok()) << status.error().message;
}

std::int32_t Rig::tick() {
  state.t_ns += config.tick_ns;
  const std::int32_t status = api().step(instance.get(), &state, &output);
  api().observe_cycle_end(instance.get(), &state);
  return status;
}

void Rig::set_pedal(bool down) {
  state.runlevel = down ? core::kPedalDown : core::kPedalUp;
  do tick();
  while ((output.doubts & RAVENCAL_DOUBT_PEDAL) != 0);
}

bool Rig::tick_until(std::int32_t wanted, int limit) {
  for (int i = 0; i < limit; ++i) {
    tick();
    if (output.state == wanted) return true;
  }
  return false;
}

}  // namespace ravencal::test
