// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <onnx/checker.h>
#include <onnx/onnx_pb.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <map>

#include "learn/model_description.hpp"
#include "learn/onnx_file.hpp"
#include "learn/onnx_metadata.hpp"
#include "model/single_precision.hpp"

namespace ravencal::learn {
namespace {

model::CalibrationModel sample_model() {
  std::srand(4);
  model::CalibrationModel model;
  model.features = {{"jpos.elbow"},
                    {"jpos.elbow", model::Transform::kLag, 3},
                    {"tau.elbow"},
                    {"mpos.elbow", model::Transform::kPlay, 0, 0.0125F}};
  model.input.mean = Eigen::VectorXd::Random(4) / 3.0;
  model.input.scale = Eigen::VectorXd::Random(4).cwiseAbs().array() + 0.1;
  model.input_min = Eigen::VectorXd::Constant(4, -1.0 / 3.0);
  model.input_max = Eigen::VectorXd::Constant(4, 2.0 / 3.0);
  const Eigen::Index widths[] = {4, 6, 5, 2};
  const model::Activation activations[] = {model::Activation::kSigmoid, model::Activation::kRelu,
                                           model::Activation::kLinear};
  for (int k = 0; k < 3; ++k) {
    model.layers.push_back({Eigen::MatrixXf::Random(widths[k + 1], widths[k]),
                            Eigen::VectorXf::Random(widths[k + 1]), activations[k]});
  }
  model.output.mean = Eigen::Vector2d(0.1, -0.002);
  model.output.scale = Eigen::Vector2d(0.02, 1e-4);
  model.outputs = {{"elbow", "jpos.elbow", "rad"}, {"insertion", "jpos.insertion", "m"}};
  model::TrustRegion trust;
  trust.directions = Eigen::MatrixXf::Random(2, 4);
  trust.inverse_variance = (Eigen::VectorXf(2) << 1.0F / 3.0F, 0.7F).finished();
  trust.inverse_residual_variance = 41.1F;
  trust.full_distance = 2.3F;
  trust.none_distance = 9.2F;
  model.trust = trust;
  model.expected = {{{0.02, 0.01, 0.05}, model::ExpectedRmse{0.03, 0.01, 0.1}, 0.015},
                    {{1.0 / 3.0, 0.0, 0.5}, std::nullopt, 0.25}};
  model.motion = {{{-0.5, 1.0 / 3.0}, "tau.elbow", {-2.0, 3.0}}, {{-0.01, 0.02}, "", {}}};
  model.seeds = {{"run1.db", 2, 18446744073709551615U, 1}, {"run2.db", 3, 4, 0}};
  model.row_period_s = 0.01;
  model.provenance = {{"seed", "3"}, {"recordings", "run \"1\".db sha256:00"}};
  return model;
}

/// What a runtime computes, as the ONNX standard defines the operators; [outputs x samples].
Eigen::MatrixXf run(const onnx::GraphProto& graph, const Eigen::MatrixXf& features) {
  using RowMajor = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  std::map<std::string, Eigen::MatrixXf> values = {{"features", features}};
  for (const onnx::TensorProto& tensor : graph.initializer()) {
    const auto* const data = reinterpret_cast<const float*>(tensor.raw_data().data());
    const Eigen::Index columns = tensor.dims_size() == 2 ? tensor.dims(1) : 1;
    values[tensor.name()] = Eigen::Map<const RowMajor>(data, tensor.dims(0), columns);
  }
  for (const onnx::NodeProto& node : graph.node()) {
    const std::string& op = node.op_type();
    Eigen::ArrayXXf x = values[node.input(0)];
    const Eigen::ArrayXXf y = values[node.input(node.input_size() - 1)].replicate(1, x.cols());
    if (op == "Max") x = x.max(y);
    if (op == "Min") x = x.min(y);
    if (op == "Sub") x -= y;
    if (op == "Add") x += y;
    if (op == "Mul") x *= y;
    if (op == "Relu") x = x.max(0.0F);
    if (op == "Sigmoid") x = 1.0F / (1.0F + (-x).exp());
    if (op == "Gemm") x = (values[node.input(1)] * x.matrix()).array() + y;
    values[node.output(0)] = x;
  }
  return values[graph.output(0).name()];
}

class OnnxFile : public testing::Test {
 protected:
  OnnxFile()
      : folder_(std::filesystem::temp_directory_path() /
                ("ravencal_onnx_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_);
  }
  ~OnnxFile() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const model::CalibrationModel& model = sample_model()) const {
    const std::filesystem::path path = folder_ / "model.onnx";
    EXPECT_TRUE(write_onnx(model, path).ok());
    return path;
  }

  static onnx::ModelProto proto_of(const std::filesystem::path& path) {
    onnx::ModelProto proto;
    std::ifstream file(path, std::ios::binary);
    EXPECT_TRUE(proto.ParseFromIstream(&file));
    return proto;
  }

  /// The reader's complaint about the sample model after `change`.
  std::string refusal_after(const std::function<void(onnx::ModelProto&)>& change) const {
    const std::filesystem::path path = write();
    onnx::ModelProto proto = proto_of(path);
    change(proto);
    std::ofstream(path, std::ios::binary) << proto.SerializeAsString();
    const auto model = read_onnx(path);
    if (model.ok()) return "accepted";
    EXPECT_EQ(model.error().code, core::ErrorCode::kData);
    return model.error().message;
  }

  std::filesystem::path folder_;
};

TEST_F(OnnxFile, ComesBackAsItWas) {
  const model::CalibrationModel model = sample_model();
  const auto read = read_onnx(write(model));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->features, model.features);
  EXPECT_EQ(read->input.mean, model.input.mean);
  EXPECT_EQ(read->input.scale, model.input.scale);
  EXPECT_EQ(read->input_min, model.input_min);
  EXPECT_EQ(read->input_max, model.input_max);
  EXPECT_EQ(read->output.mean, model.output.mean);
  EXPECT_EQ(read->output.scale, model.output.scale);
  ASSERT_TRUE(read->trust.has_value());
  EXPECT_EQ(read->trust->directions, model.trust->directions);
  EXPECT_EQ(read->trust->inverse_variance, model.trust->inverse_variance);
  EXPECT_EQ(read->trust->inverse_residual_variance, model.trust->inverse_residual_variance);
  EXPECT_EQ(read->trust->full_distance, model.trust->full_distance);
  EXPECT_EQ(read->trust->none_distance, model.trust->none_distance);
  EXPECT_EQ(read->row_period_s, model.row_period_s);
  ASSERT_EQ(read->expected.size(), model.expected.size());
  for (std::size_t k = 0; k < model.expected.size(); ++k) {
    for (const auto& [got, wrote] :
         {std::pair{read->expected[k].any(), model.expected[k].any()},
          std::pair{read->expected[k].same_homing, model.expected[k].same_homing}}) {
      EXPECT_EQ(got.rmse, wrote.rmse);
      EXPECT_EQ(got.low, wrote.low);
      EXPECT_EQ(got.high, wrote.high);
    }
    EXPECT_EQ(read->expected[k].other_homing.has_value(), k == 0);
    EXPECT_EQ(read->expected[k].about_mean, model.expected[k].about_mean);
  }
  ASSERT_TRUE(read->motion.has_value());
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ((*read->motion)[k].speed.low, (*model.motion)[k].speed.low);
    EXPECT_EQ((*read->motion)[k].speed.high, (*model.motion)[k].speed.high);
    EXPECT_EQ((*read->motion)[k].load.low, (*model.motion)[k].load.low);
    EXPECT_EQ((*read->motion)[k].load.high, (*model.motion)[k].load.high);
    EXPECT_EQ((*read->motion)[k].load_channel, (*model.motion)[k].load_channel);
  }
  EXPECT_EQ(read->seeds, model.seeds);
  EXPECT_EQ(read->provenance, model.provenance);
  ASSERT_EQ(read->layers.size(), 3U);
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_EQ(read->layers[k].weights, model.layers[k].weights);
    EXPECT_EQ(read->layers[k].biases, model.layers[k].biases);
    EXPECT_EQ(read->layers[k].activation, model.layers[k].activation);
  }
  EXPECT_EQ(read->outputs[1].joint, "insertion");
  EXPECT_EQ(read->outputs[1].estimate_channel, "jpos.insertion");
  EXPECT_EQ(read->outputs[1].unit, "m");
}

TEST_F(OnnxFile, KeepsMeans) {
  model::CalibrationModel model = sample_model();
  model.features[1] = {"jpos.elbow", model::Transform::kMean, 0, 0.0F, 0.1F};
  model.features[2] = {"tau.elbow", model::Transform::kMeanOfAbs, 0, 0.0F, 30.0F};
  const auto read = read_onnx(write(model));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->features, model.features);
  const std::string text = describe_in_words(*read);
  for (const char* words : {"jpos.elbow%0.1", "tau.elbow%abs30"}) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  }
}

TEST_F(OnnxFile, KeepsMeansOverTravelAndTheirPosition) {
  model::CalibrationModel model = sample_model();
  model.features[1] = {"tau.elbow", model::Transform::kTravelMean, 0, 0.0F, 0.0F, 0.1F,
                       "jpos.elbow"};
  model.features[3] = {"mpos.elbow", model::Transform::kTravelMeanOfAbs, 0, 0.0F, 0.0F, 30.0F,
                       "jpos.elbow"};
  const auto read = read_onnx(write(model));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_EQ(read->features, model.features);
  const std::string text = describe_in_words(*read);
  for (const char* words : {"tau.elbow%0.1:jpos.elbow", "mpos.elbow%abs30:jpos.elbow"}) {
    EXPECT_NE(text.find(words), std::string::npos) << text;
  }
}

TEST_F(OnnxFile, PassesTheCheckerOfOnnx) {
  EXPECT_NO_THROW(onnx::checker::check_model(proto_of(write())));
}

TEST_F(OnnxFile, ItsGraphClampsInputsFarOutsideOfTheTrainedRangeAsTheModelDoes) {
  const model::CalibrationModel model = sample_model();
  Eigen::MatrixXf far = Eigen::MatrixXf::Random(4, 50);
  far.rightCols(40) *= 30.0F;
  const Eigen::MatrixXf by_graph = run(proto_of(write()).graph(), far);
  const Eigen::MatrixXf by_plugin = model::predict_single(model, far);
  const Eigen::MatrixXd by_model = model.predict(far.transpose().cast<double>()).transpose();
  for (Eigen::Index k = 0; k < 2; ++k) {
    const double tolerance = 1e-5 * model.output.scale[k];
    EXPECT_LT((by_graph - by_plugin).row(k).cwiseAbs().maxCoeff(), tolerance);
    EXPECT_LT((by_model - by_plugin.cast<double>()).row(k).cwiseAbs().maxCoeff(), tolerance);
  }
}

TEST_F(OnnxFile, OfAnEarlierVersionDoesNotClampInItsGraphAndIsTheSameModel) {
  const std::filesystem::path path = write();
  onnx::ModelProto proto = proto_of(path);
  proto.mutable_graph()->mutable_node()->DeleteSubrange(0, 2);
  proto.mutable_graph()->mutable_node(0)->set_input(0, "features");
  std::ofstream(path, std::ios::binary) << proto.SerializeAsString();
  const auto read = read_onnx(path);
  ASSERT_TRUE(read.ok()) << read.error().message;
  const Eigen::MatrixXd far = 30.0 * Eigen::MatrixXd::Random(50, 4);
  EXPECT_EQ(read->predict(far), sample_model().predict(far));
}

TEST_F(OnnxFile, RefusesClampingThatContradictsTheMetadata) {
  const std::string refusal = refusal_after([](onnx::ModelProto& proto) {
    for (auto& property : *proto.mutable_metadata_props()) {
      if (property.key() == "ravencal.input_max") property.set_value("[1, 2, 3, 4]");
    }
  });
  EXPECT_NE(refusal.find("contradicts the metadata's input_min and input_max"), std::string::npos)
      << refusal;
}

TEST_F(OnnxFile, FailsTheCheckerOfOnnxWhenAnOperatorIsUnknown) {
  onnx::ModelProto proto = proto_of(write());
  proto.mutable_graph()->mutable_node(3)->set_op_type("Sigmoidal");
  EXPECT_THROW(onnx::checker::check_model(proto), std::exception);
}

TEST_F(OnnxFile, DeclaresRawFeaturesInAndJointErrorOut) {
  const onnx::GraphProto graph = proto_of(write()).graph();
  ASSERT_EQ(graph.input_size(), 1);
  EXPECT_EQ(graph.input(0).name(), "features");
  EXPECT_EQ(graph.input(0).type().tensor_type().shape().dim(1).dim_value(), 4);
  ASSERT_EQ(graph.output_size(), 1);
  EXPECT_EQ(graph.output(0).name(), "joint_error");
  EXPECT_EQ(graph.output(0).type().tensor_type().shape().dim(1).dim_value(), 2);
}

TEST_F(OnnxFile, NamesAnOperatorThatItDoesNotSupport) {
  const std::string refusal = refusal_after([](onnx::ModelProto& proto) {
    proto.mutable_graph()->mutable_node(5)->set_op_type("LeakyRelu");
  });
  EXPECT_NE(refusal.find("LeakyRelu"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("model.onnx"), std::string::npos) << refusal;
}

TEST_F(OnnxFile, RefusesWeightsOfAnotherShape) {
  const std::string refusal = refusal_after([](onnx::ModelProto& proto) {
    for (auto& tensor : *proto.mutable_graph()->mutable_initializer()) {
      if (tensor.name() != "weights_0") continue;
      tensor.set_dims(0, 8);
      tensor.set_dims(1, 3);
    }
  });
  EXPECT_NE(refusal.find("8 x 3"), std::string::npos) << refusal;
}

TEST_F(OnnxFile, RefusesWeightsThatAreNotThere) {
  const std::string refusal = refusal_after([](onnx::ModelProto& proto) {
    for (auto& tensor : *proto.mutable_graph()->mutable_initializer()) {
      if (tensor.name() == "weights_1") tensor.mutable_raw_data()->resize(8);
    }
  });
  EXPECT_NE(refusal.find("does not hold its 30 values"), std::string::npos) << refusal;
}

TEST_F(OnnxFile, RefusesWeightsThatAreNotFinite) {
  const std::string refusal = refusal_after([](onnx::ModelProto& proto) {
    for (auto& tensor : *proto.mutable_graph()->mutable_initializer()) {
      if (tensor.name() == "biases_1") tensor.mutable_raw_data()->replace(0, 4, "\xff\xff\xff\x7f");
    }
  });
  EXPECT_NE(refusal.find("not finite"), std::string::npos) << refusal;
}

TEST_F(OnnxFile, RefusesAScalingThatContradictsTheMetadata) {
  const std::string refusal = refusal_after([](onnx::ModelProto& proto) {
    for (auto& property : *proto.mutable_metadata_props()) {
      if (property.key() == "ravencal.input_mean") property.set_value("[1, 2, 3, 4]");
    }
  });
  EXPECT_NE(refusal.find("contradicts the metadata's input_mean"), std::string::npos) << refusal;
}

TEST_F(OnnxFile, OfAnEarlierVersionHasNoTrustRegionAndSaysSo) {
  model::CalibrationModel model = sample_model();
  model.trust.reset();
  const auto read = read_onnx(write(model));
  ASSERT_TRUE(read.ok()) << read.error().message;
  EXPECT_FALSE(read->trust.has_value());
  EXPECT_NE(describe_in_words(*read).find("trust: none"), std::string::npos);
  EXPECT_NE(describe_in_json(*read).find("\"trust\": null"), std::string::npos);
}

TEST_F(OnnxFile, RefusesAnythingWhoseMetadataLacksOneKey) {
  for (const auto& entry : metadata_of(sample_model())) {
    const std::string& key = entry.first;
    // Models of earlier versions have none of these.
    if (key == "ravencal.input_trust" || key == "ravencal.origin" || key == "ravencal.gains" ||
        key == "ravencal.motion" || key == "ravencal.expected" || key == "ravencal.random_seeds") {
      continue;
    }
    const std::string refusal = refusal_after([&](onnx::ModelProto& proto) {
      for (auto& property : *proto.mutable_metadata_props()) {
        if (property.key() == key) property.set_key("other");
      }
    });
    EXPECT_NE(refusal.find(key), std::string::npos) << refusal;
  }
}

TEST_F(OnnxFile, RefusesEveryWrongValueInTheMetadataWithoutCrashing) {
  for (const auto& entry : metadata_of(sample_model())) {
    const std::string& key = entry.first;
    for (const char* wrong : {"", "[", "[]", "{}", "null", "\"text\"", "[null]", "-1", "[1e999]"}) {
      if (key == "ravencal.provenance" && std::string(wrong) == "{}") continue;
      if (key == "ravencal.random_seeds" && std::string(wrong) == "[]")
        continue;  // none was simulated
      const std::string refusal = refusal_after([&](onnx::ModelProto& proto) {
        for (auto& property : *proto.mutable_metadata_props()) {
          if (property.key() == key) property.set_value(wrong);
        }
      });
      EXPECT_NE(refusal, "accepted") << key << " = " << wrong;
    }
  }
}

TEST_F(OnnxFile, RefusesEveryTruncationWithoutCrashing) {
  const std::filesystem::path path = write();
  const std::string whole = proto_of(path).SerializeAsString();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    std::ofstream(path, std::ios::binary) << whole.substr(0, size);
    EXPECT_FALSE(read_onnx(path).ok()) << size << " of " << whole.size() << " bytes";
  }
}

TEST_F(OnnxFile, SaysWhyItCannotBeWritten) {
  const core::Status status = write_onnx(sample_model(), folder_ / "none" / "m.onnx");
  ASSERT_FALSE(status.ok());
  EXPECT_EQ(status.error().code, core::ErrorCode::kIo);
  EXPECT_NE(status.error().message.find("No such file"), std::string::npos)
      << status.error().message;
}

TEST_F(OnnxFile, IsDescribedInWords) {
  const auto model = read_onnx(write());
  ASSERT_TRUE(model.ok()) << model.error().message;
  const std::string text = describe_in_words(*model);
  const std::string json = describe_in_json(*model);
  for (const char* words : {"4-6-5-2", "jpos.elbow@3", "mpos.elbow~0.0125", "insertion", "seed: 3",
                            "trust: 2 directions"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words;
  }
  EXPECT_NE(json.find("\"jpos.elbow@3\""), std::string::npos) << json;
}

}  // namespace
}  // namespace ravencal::learn
