// SPDX-License-Identifier: Apache-2.0
//
// Weights of the shapes that `train` makes: the plugin takes what the writer wrote, with every
// instruction set, and refuses it with a wrong weight or activation.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <random>

#include "choice/assemble.hpp"
#include "conversion/kernel_check.hpp"
#include "core/whole_file.hpp"
#include "model/blob_format.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "rt/rig.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::test {
namespace {

using model::Activation;
using model::packed::Precision;

constexpr int kModels = 200;
constexpr std::array kPrecisions = {Precision::kFloat32, Precision::kBfloat16, Precision::kInt8};

/// Random units tanh(w z + b) and the linear part of each output, read out by a ridge whose weights
/// may be many times the output: as `train` chooses by itself.
std::vector<model::DenseLayer> random_units(Eigen::Index inputs, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  const auto matrix = [&](Eigen::Index rows, Eigen::Index columns, double spread) {
    return Eigen::MatrixXd(
        Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return spread * normal(random); }));
  };
  const Eigen::MatrixXd scaled = matrix(50, inputs, 1.0);
  std::vector<choice::Part> parts;
  for (Eigen::Index output = 0; output < RAVENCAL_JOINTS; ++output) {
    choice::BasisSpec spec;
    for (Eigen::Index i = 0; i < inputs; ++i) spec.columns.push_back(i);
    spec.units = std::uniform_int_distribution<Eigen::Index>(100, 350)(random);
    spec.steepness = std::uniform_real_distribution<double>(0.1, 2.0)(random);
    spec.seed = random();
    choice::Part part{output, choice::draw(spec), {}};
    const double size = std::pow(10.0, std::uniform_real_distribution<double>(-2.0, 1.0)(random));
    part.readout = matrix(part.basis.size(), 1, size);
    parts.push_back(std::move(part));
  }
  return choice::layers_of(
      parts, scaled,
      {Eigen::VectorXd::Zero(RAVENCAL_JOINTS), Eigen::VectorXd::Ones(RAVENCAL_JOINTS)});
}

model::CalibrationModel random_model(int number) {
  std::mt19937_64 random(static_cast<std::uint64_t>(number) + 1);
  const auto inputs = std::uniform_int_distribution<std::uint32_t>(8, 240)(random);
  const std::vector<std::vector<std::uint32_t>> networks = {
      {128, 64, 32}, {64, 32}, {256}, {600, 300, 100}};
  if (number % 4 == 0) return make_model(inputs, {}, random());
  model::CalibrationModel model =
      make_model(inputs, networks[random() % networks.size()], random());
  if (number % 4 == 1) return model;
  if (number % 4 == 2) {
    for (std::size_t l = 0; l + 1 < model.layers.size(); ++l)
      model.layers[l].activation = Activation::kTanh;
    return model;
  }
  model.layers = random_units(inputs, random);
  return model;
}

std::vector<std::byte> blob_of(const model::CalibrationModel& model, Precision precision) {
  auto blob = model::encode_blob(model, packing_of(model, precision));
  EXPECT_TRUE(blob.ok()) << blob.error().message;
  return blob.ok() ? *blob : std::vector<std::byte>{};
}

/// What the plugin says to these bytes; empty: it takes them.
std::string refusal(const std::vector<std::byte>& blob, std::uint32_t max_isa) {
  static const Rig rig;
  const std::filesystem::path path = scratch_folder() / "self_test.blob";
  EXPECT_TRUE(model::write_blob(blob, path).ok());
  ravencal_config config = rig.config;
  config.max_isa = max_isa;
  auto instance = plugin_host::Instance::create(rig.library, config);
  EXPECT_TRUE(instance.ok());
  const core::Status loaded = instance->load(path);
  return loaded.ok() ? "" : loaded.error().message;
}

TEST(SelfTest, EveryInstructionSetTakesWhatTheWriterWrote) {
  std::map<Precision, double> largest_tolerance;  // of the largest output
  for (int number = 0; number < kModels; ++number) {
    const model::CalibrationModel model = random_model(number);
    for (const Precision precision : kPrecisions) {
      const std::vector<std::byte> blob = blob_of(model, precision);
      const auto names = conversion::check_kernels(blob, "weights");
      EXPECT_TRUE(names.ok()) << names.error().message;
      for (const std::uint32_t isa : {RAVENCAL_ISA_BASELINE, RAVENCAL_ISA_AVX2, RAVENCAL_ISA_AVX512,
                                      RAVENCAL_ISA_AVX512_VNNI}) {
        EXPECT_EQ(refusal(blob, isa), "") << "model " << number;
      }
      model::BlobView view;
      ASSERT_TRUE(model::BlobView::open(blob, view).ok());
      for (std::size_t j = 0; j < view.output_count(); ++j) {
        double spread = view.output_scale(j);
        for (std::size_t row = 0; row < view.self_test_count(); ++row) {
          spread = std::max(spread, std::abs(view.self_test_output(row, j) - view.output_mean(j)));
        }
        double& largest = largest_tolerance[precision];
        largest = std::max(largest, view.self_test_tolerance(j) / spread);
      }
    }
  }
  // A tolerance that lets everything pass would pass above. int8: an error may move a rounded input
  // of every later layer over a boundary.
  for (const auto& [precision, largest] : largest_tolerance) {
    EXPECT_LT(largest, precision == Precision::kInt8 ? 0.2 : 0.02);
  }
}

/// The stored network of a blob, to be changed.
struct Stored {
  explicit Stored(std::vector<std::byte>& blob)
      : base(blob.data() + model::blob::section_entry(blob.data(), model::blob::kNetwork).offset) {}
  [[nodiscard]] model::packed::PackedLayer layer(std::size_t l) const {
    return model::packed::PackedView{base}.layer(l);
  }
  std::byte* base;
};

TEST(SelfTest, FindsAWrongActivation) {
  for (int number = 1; number < kModels; number += 2) {
    const model::CalibrationModel model = random_model(number);
    for (const Precision precision : kPrecisions) {
      std::vector<std::byte> blob = blob_of(model, precision);
      const Stored stored(blob);
      const bool is_tanh = stored.layer(0).activation == Activation::kTanh;
      const auto other =
          static_cast<std::uint8_t>(is_tanh ? Activation::kSigmoid : Activation::kTanh);
      std::memcpy(stored.base + sizeof(model::packed::PackedHeader) +
                      offsetof(model::packed::PackedLayer, activation),
                  &other, 1);
      repair_checksum(blob);
      EXPECT_NE(refusal(blob, RAVENCAL_ISA_BEST).find("self-test"), std::string::npos) << number;
      EXPECT_FALSE(conversion::check_kernels(blob, "weights").ok());
    }
  }
}

/// A unit of the first layer with the median weight in what follows.
Eigen::Index median_unit(const model::CalibrationModel& model) {
  if (model.layers.size() < 2) return 0;
  const Eigen::VectorXf sizes = model.layers[1].weights.cwiseAbs().colwise().maxCoeff();
  std::vector<Eigen::Index> order(static_cast<std::size_t>(sizes.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::sort(order.begin(), order.end(),
            [&](Eigen::Index a, Eigen::Index b) { return sizes[a] < sizes[b]; });
  return order[order.size() / 2];
}

/// The largest change of an output on the rows of the self-test, in parts of the output's scale.
double change_on_self_test(const model::CalibrationModel& right,
                           const model::CalibrationModel& wrong, const model::BlobView& view) {
  const auto rows = static_cast<Eigen::Index>(view.self_test_count());
  const auto inputs = static_cast<Eigen::Index>(view.feature_count());
  const Eigen::MatrixXd x =
      Eigen::MatrixXd::NullaryExpr(rows, inputs, [&](Eigen::Index row, Eigen::Index i) {
        return static_cast<double>(
            view.self_test_input(static_cast<std::size_t>(row), static_cast<std::size_t>(i)));
      });
  const Eigen::MatrixXd change = (wrong.predict(x) - right.predict(x)).cwiseAbs();
  return (change.array().rowwise() / right.output.scale.transpose().array()).maxCoeff();
}

// One weight of one unit with the wrong sign, where that changes the outputs by a thousandth: the
// tolerance hides no more than one in fifty.
TEST(SelfTest, FindsOneWrongWeightOfOneUnit) {
  constexpr double kMatters = 1e-3;
  int mattered = 0;
  int missed = 0;
  for (int number = 0; number < kModels; ++number) {
    const model::CalibrationModel model = random_model(number);
    const Eigen::Index unit = median_unit(model);
    Eigen::Index input = 0;
    model.layers[0].weights.row(unit).cwiseAbs().maxCoeff(&input);
    model::CalibrationModel wrong = model;
    wrong.layers[0].weights(unit, input) *= -1.0F;
    for (const Precision precision : {Precision::kFloat32, Precision::kBfloat16}) {
      std::vector<std::byte> blob = blob_of(model, precision);
      model::BlobView view;
      ASSERT_TRUE(model::BlobView::open(blob, view).ok());
      if (change_on_self_test(model, wrong, view) < kMatters) continue;
      ++mattered;
      const Stored stored(blob);
      const model::packed::PackedLayer layer = stored.layer(0);
      const std::size_t bytes = layer.precision == Precision::kFloat32 ? 4 : 2;
      const std::size_t element = model::packed::element_index(
          layer, static_cast<std::size_t>(unit), static_cast<std::size_t>(input));
      stored.base[layer.weights_at + (element + 1) * bytes - 1] ^= std::byte{0x80};
      repair_checksum(blob);
      const std::string said = refusal(blob, RAVENCAL_ISA_BEST);
      EXPECT_TRUE(said.empty() || said.find("self-test") != std::string::npos) << said;
      EXPECT_EQ(conversion::check_kernels(blob, "weights").ok(), said.empty()) << number;
      missed += said.empty() ? 1 : 0;
    }
  }
  EXPECT_LE(50 * missed, mattered);
  EXPECT_GT(mattered, kModels) << "of " << 2 * kModels;
}

}  // namespace
}  // namespace ravencal::test
