// SPDX-License-Identifier: Apache-2.0
//
// Models of PyTorch, TensorFlow and Keras against what their makers say that they compute.
#include <gtest/gtest.h>
#include <onnx/onnx_pb.h>
#include <unistd.h>

#include <functional>

#include "conversion/assemble.hpp"
#include "conversion/source_check.hpp"
#include "conversion/window.hpp"
#include "core/whole_file.hpp"
#include "exchange/npz.hpp"
#include "model/blob_writer.hpp"
#include "unit/conversion_models.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

// Their arithmetic is ours, double; only the order of sums differs.
constexpr double kSameInDouble = 1e-9;

double largest(const Eigen::MatrixXd& values) { return values.cwiseAbs().maxCoeff(); }

TEST(ForeignModels, AreRunAsTheirMakersRunThem) {
  for (const Expected& expected : expected_models()) {
    const auto source = read_foreign(kModels / expected.file);
    ASSERT_TRUE(source.ok()) << source.error().message;
    const auto outputs = source->run(expected.samples);
    ASSERT_TRUE(outputs.ok()) << expected.file << ": " << outputs.error().message;
    EXPECT_LT(largest(*outputs - expected.outputs), kSameInDouble * largest(expected.outputs))
        << expected.file;
  }
}

TEST(ForeignModels, ComputeTheSameOnceTheyAreFolded) {
  for (const Expected& expected : expected_models()) {
    const auto source = read_foreign(kModels / expected.file);
    ASSERT_TRUE(source.ok()) << source.error().message;
    const auto model = conversion::assemble(*source, plain_scaling(*source, 1.0), {});
    ASSERT_TRUE(model.ok()) << expected.file << ": " << model.error().message;
    std::vector<Eigen::MatrixXf> samples;
    for (const auto& sample : expected.samples) samples.push_back(sample.cast<float>());
    ASSERT_EQ(samples.size(), conversion::window_of(*model)) << expected.file;
    // Inputs are rounded to f32, and so are weights that took up a scale.
    const double tolerance = 1e-5 * largest(expected.outputs);
    EXPECT_LT(largest(conversion::predict_exact(*model, samples) - expected.outputs), tolerance)
        << expected.file;
    EXPECT_LT(largest(conversion::predict_packed(*model, samples) - expected.outputs), tolerance)
        << expected.file;
  }
}

TEST(ForeignModels, AGruSeesTheOrderOfItsSamples) {
  for (Expected& expected : expected_models()) {
    if (expected.samples.size() == 1) continue;
    const auto source = read_foreign(kModels / expected.file);
    ASSERT_TRUE(source.ok());
    std::swap(expected.samples.front(), expected.samples.back());
    EXPECT_GT(largest(*source->run(expected.samples) - expected.outputs), 1e-3);
  }
}

/// What the check says of the sample models after `change` of the weights.
bool passes_after(const std::function<void(model::CalibrationModel&)>& change) {
  const auto source = read_foreign(kModels / "keras3_gru.h5");
  const auto scaling = conversion::read_scaling_file((kModels / "scaling.json").string());
  if (!source.ok() || !scaling.ok()) return false;
  auto model = conversion::assemble(*source, *scaling, {});
  if (!model.ok()) return false;
  model::CalibrationModel weights = *model;
  change(weights);
  const auto check = conversion::check_source(*source, *scaling, *model, weights, {0, 1, 2, 3});
  return check.ok() && check->joints[0].is_rounding() && check->joints[1].is_rounding();
}

TEST(SourceCheck, PassesWhatIsTheSameAndRingsAtOneWrongWeight) {
  EXPECT_TRUE(passes_after([](auto&) {}));
  EXPECT_FALSE(passes_after([](auto& model) { model.layers[2].weights(3, 4) *= 1.2F; }));
  EXPECT_FALSE(passes_after([](auto& model) { model.layers[1].biases[40] += 0.05F; }));
  EXPECT_FALSE(passes_after([](auto& model) { model.input.mean[1] += 0.01; }));
  EXPECT_FALSE(passes_after([](auto& model) { model.output.mean[0] += 1e-4; }));
}

TEST(ScalingFile, SaysTheSameAsJsonAndAsNpz) {
  const auto json = conversion::read_scaling_file((kModels / "scaling.json").string());
  ASSERT_TRUE(json.ok()) << json.error().message;
  EXPECT_DOUBLE_EQ(json->feature_to_si[0], M_PI / 180.0);
  EXPECT_EQ(json->outputs[1].unit, "m");
  for (const char* name : {"scaling.npz", "scaling_compressed.npz"}) {
    const auto npz = conversion::read_scaling_file((kModels / name).string());
    ASSERT_TRUE(npz.ok()) << npz.error().message;
    EXPECT_EQ(npz->features, json->features);
    EXPECT_EQ(npz->feature_to_si, json->feature_to_si);
    EXPECT_EQ(npz->input->mean, json->input->mean);
    EXPECT_EQ(npz->input->scale, json->input->scale);
    EXPECT_EQ(npz->output->scale, json->output->scale);
    EXPECT_EQ(npz->input_max, json->input_max);
    EXPECT_EQ(npz->output_to_si, json->output_to_si);
    EXPECT_EQ(npz->row_period_s, json->row_period_s);
  }
}

class Files : public ::testing::Test {
 protected:
  Files() { fs::create_directories(folder_); }
  ~Files() override { fs::remove_all(folder_); }

  [[nodiscard]] std::string write(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
    return (folder_ / name).string();
  }
  /// The scaling file with `key` set to `value`, or taken out.
  [[nodiscard]] std::string complaint(const std::string& key, const nlohmann::json& value) const {
    std::ifstream stream(kModels / "scaling.json");
    auto json = nlohmann::json::parse(stream);
    json[key] = value;
    if (value.is_null()) json.erase(key);
    const auto file = conversion::read_scaling_file(write("scaling.json", json.dump()));
    return file.ok() ? "accepted" : file.error().message;
  }
  /// The reader's complaint about the plain PyTorch model after `change`.
  [[nodiscard]] std::string refusal(const std::function<void(onnx::GraphProto&)>& change) const {
    onnx::ModelProto proto;
    std::ifstream file(kModels / "torch_plain.onnx", std::ios::binary);
    EXPECT_TRUE(proto.ParseFromIstream(&file));
    change(*proto.mutable_graph());
    const auto model = conversion::read_foreign_onnx(write("m.onnx", proto.SerializeAsString()));
    return model.ok() ? "accepted" : model.error().message;
  }

  fs::path folder_ =
      fs::temp_directory_path() / ("ravencal_conversion_" + std::to_string(::getpid()));
};

TEST_F(Files, OfScalingAreRefusedWithTheKeyThatIsWrong) {
  EXPECT_EQ(complaint("row_period_s", 0.005), "accepted");
  const std::pair<const char*, nlohmann::json> wrong[] = {
      {"input_mean", {1.0, 2.0}},
      {"input_scale", {1.0, 0.0, 1.0, 1.0}},
      {"feature_units", {"deg", "rad"}},
      {"feature_units", {"deg", "rad", "N_m", "furlong"}},
      {"output_units", {"deg", "N_m"}},
      {"output_joints", nullptr},
      {"features", nullptr},
      {"input_max", {-50.0, 6.0, 2.0, 260.0}},
      {"window", 9},
      {"row_period_s", -1.0},
      {"output_mean", "none"}};
  for (const auto& [key, value] : wrong) {
    const std::string text = complaint(key, value);
    EXPECT_NE(text.find(key), std::string::npos) << key << ": " << text;
  }
  EXPECT_NE(complaint("input_men", 1.0).find("unknown key 'input_men'"), std::string::npos);
  EXPECT_NE(complaint("features", {"jpos.shoulder", "x", "y", "z"}).find("no channel 'x'"),
            std::string::npos);
  EXPECT_NE(complaint("features", {1, 13, 14, 15}).find("column 1"), std::string::npos)
      << "a truth is no input";
}

TEST_F(Files, OfScalingTakeColumnsOfTheAuthorsTable) {
  std::ifstream stream(kModels / "scaling.json");
  auto json = nlohmann::json::parse(stream);
  json["features"] = {13, 14, 131, 12};
  const auto gold = conversion::read_scaling_file(write("gold.json", json.dump()));
  json["arm"] = "green";
  json["newest_rows_ago"] = 5;
  const auto green = conversion::read_scaling_file(write("green.json", json.dump()));
  json["features"] = {"jpos.elbow", "tau.elbow%0.5", "tau.elbow%abs2", "jpos.elbow@3"};
  const auto late = conversion::read_scaling_file(write("late.json", json.dump()));
  json["features"] = {"jpos.elbow", "tau.elbow", "tau.elbow%abs2:jpos.elbow", "jpos.elbow@3"};
  const auto late_travel = conversion::read_scaling_file(write("late_travel.json", json.dump()));
  json.erase("newest_rows_ago");
  json["feature_units"] = "si";
  const auto travel = conversion::read_scaling_file(write("travel.json", json.dump()));
  json["features"] = {"jpos.elbow", "tau.elbow%0.5", "tau.elbow%abs2", "jpos.elbow@3"};
  const auto means = conversion::read_scaling_file(write("means.json", json.dump()));
  ASSERT_FALSE(late.ok());
  EXPECT_NE(late.error().message.find("mean ('tau.elbow%0.5')"), std::string::npos)
      << late.error().message;
  ASSERT_FALSE(late_travel.ok());
  EXPECT_NE(late_travel.error().message.find("mean ('tau.elbow%abs2:jpos.elbow')"),
            std::string::npos)
      << late_travel.error().message;
  ASSERT_TRUE(travel.ok()) << travel.error().message;
  EXPECT_EQ(travel->features[2].along, "jpos.elbow");
  ASSERT_TRUE(means.ok()) << means.error().message;
  EXPECT_EQ(means->features[2].text(), "tau.elbow%abs2");
  ASSERT_TRUE(gold.ok() && green.ok()) << gold.error().message;
  EXPECT_EQ(gold->features[0].text(), "jpos.shoulder");
  EXPECT_EQ(gold->features[2].text(), "mpos.elbow");
  EXPECT_EQ(gold->features[3].text(), "time");
  EXPECT_EQ(green->features[0].text(), "other.jpos.shoulder@5");
  EXPECT_DOUBLE_EQ(green->feature_to_si[0], M_PI / 180.0);
}

TEST_F(Files, OfNumpyThatAreCutOffAreRefused) {
  const auto whole = core::read_whole_file(kModels / "scaling_compressed.npz");
  ASSERT_TRUE(whole.ok());
  for (std::size_t size = 0; size < whole->size(); size += 7) {
    EXPECT_FALSE(exchange::read_npz(write("cut.npz", whole->substr(0, size))).ok()) << size;
  }
}

TEST_F(Files, OfOnnxAreRefusedWithTheNodeThatIsWrong) {
  EXPECT_EQ(refusal([](auto&) {}), "accepted");
  const auto says = [](const std::string& text, const char* part) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
  };
  says(refusal([](auto& graph) { graph.mutable_node(2)->set_op_type("GRU"); }), "model.h5");
  says(refusal([](auto& graph) { graph.mutable_node(1)->set_op_type("Elu"); }), "(operator Elu)");
  says(refusal([](auto& graph) { graph.mutable_node(2)->set_domain("ai.onnx.ml"); }), "domain");
  says(refusal([](auto& graph) { graph.mutable_node(2)->set_input(0, "x"); }), "branches");
  says(refusal([](auto& graph) {
         graph.mutable_node(3)->set_op_type("Tanh");
         graph.mutable_node(2)->set_op_type("Tanh");
       }),
       "activation");
  says(refusal([](auto& graph) { graph.mutable_initializer(0)->set_dims(0, 7); }), "values");
  says(refusal([](auto& graph) {  // 8 TB, if it were believed
         graph.mutable_initializer(0)->set_dims(0, 1 << 20);
         graph.mutable_initializer(0)->set_dims(1, 1 << 20);
       }),
       "values");
  says(refusal([](auto& graph) {
         graph.mutable_initializer(0)->set_data_location(onnx::TensorProto::EXTERNAL);
       }),
       "one file");
  says(refusal([](auto& graph) {
         graph.mutable_initializer(0)->set_data_type(onnx::TensorProto::FLOAT16);
       }),
       "float32");
  says(refusal([](auto& graph) { graph.mutable_output(0)->set_name("z"); }), "'z'");
  says(refusal([](auto& graph) {
         graph.mutable_input(0)
             ->mutable_type()
             ->mutable_tensor_type()
             ->mutable_shape()
             ->mutable_dim(1)
             ->clear_dim_value();
       }),
       "fixed number");
}

TEST_F(Files, OfOnnxThatAreCutOffAreRefused) {
  const auto whole = core::read_whole_file(kModels / "torch_scaled.onnx");
  ASSERT_TRUE(whole.ok());
  // The opset comes last: no file without its end is whole.
  for (std::size_t size = 0; size < whole->size(); size += 13) {
    EXPECT_FALSE(conversion::read_foreign_onnx(write("cut.onnx", whole->substr(0, size))).ok())
        << size;
  }
}

}  // namespace
}  // namespace ravencal::test
