// SPDX-License-Identifier: Apache-2.0
//
// ONNX layers that are folded or passed on, on a small network whose answers are worked out by hand
// from the formulas of the operators.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <onnx/onnx_pb.h>
#include <unistd.h>

#include "unit/conversion_fold.hpp"

namespace ravencal::test {
namespace {

namespace fs = std::filesystem;

/// A graph put together node by node; `x` goes in, `y` comes out.
class Graph {
 public:
  Graph() {
    proto_.set_ir_version(8);
    proto_.add_opset_import()->set_version(15);
    auto* input = proto_.mutable_graph()->add_input();
    input->set_name("x");
    auto* shape = input->mutable_type()->mutable_tensor_type()->mutable_shape();
    shape->add_dim()->set_dim_param("rows");
    shape->add_dim()->set_dim_value(2);
    proto_.mutable_graph()->add_output()->set_name("y");
  }
  Graph& tensor(const std::string& name, const std::vector<std::int64_t>& dims,
                const Values& values) {
    auto* tensor = proto_.mutable_graph()->add_initializer();
    tensor->set_name(name);
    tensor->set_data_type(onnx::TensorProto::DOUBLE);
    for (const std::int64_t dim : dims) tensor->add_dims(dim);
    for (const double value : values) tensor->add_double_data(value);
    return *this;
  }
  Graph& integers(const std::string& name, const std::vector<std::int64_t>& values) {
    auto* tensor = proto_.mutable_graph()->add_initializer();
    tensor->set_name(name);
    tensor->set_data_type(onnx::TensorProto::INT64);
    tensor->add_dims(static_cast<std::int64_t>(values.size()));
    for (const std::int64_t value : values) tensor->add_int64_data(value);
    return *this;
  }
  onnx::NodeProto& node(const std::string& op, const std::vector<std::string>& inputs,
                        const std::string& output) {
    auto* node = proto_.mutable_graph()->add_node();
    node->set_op_type(op);
    for (const std::string& input : inputs) node->add_input(input);
    node->add_output(output);
    return *node;
  }
  /// y = [[2, -1], [0.5, 3]] value + [0.25, -1].
  void dense(const std::string& value, const std::string& output) {
    if (proto_.graph().initializer().empty() || !has_dense_) {
      tensor("w", {2, 2}, {2.0, 0.5, -1.0, 3.0}).tensor("b", {2}, {0.25, -1.0});
      has_dense_ = true;
    }
    node("Gemm", {value, "w", "b"}, output);
  }
  onnx::ModelProto& proto() { return proto_; }

  [[nodiscard]] core::Result<conversion::ForeignModel> read() const {
    const fs::path file = fs::temp_directory_path() / fmt::format("fold_{}.onnx", ::getpid());
    std::ofstream(file, std::ios::binary) << proto_.SerializeAsString();
    auto model = conversion::read_foreign_onnx(file.string());
    fs::remove(file);
    return model;
  }
  [[nodiscard]] std::string refusal() const {
    const auto model = read();
    return model.ok() ? "accepted" : model.error().message;
  }

 private:
  onnx::ModelProto proto_;
  bool has_dense_ = false;
};

void set(onnx::NodeProto& node, const char* name, float value) {
  auto* attribute = node.add_attribute();
  attribute->set_name(name);
  attribute->set_type(onnx::AttributeProto::FLOAT);
  attribute->set_f(value);
}

void set(onnx::NodeProto& node, const char* name, std::int64_t value) {
  auto* attribute = node.add_attribute();
  attribute->set_name(name);
  attribute->set_type(onnx::AttributeProto::INT);
  attribute->set_i(value);
}

void normalise(Graph& graph, const std::string& value, const std::string& output) {
  graph.tensor("scale", {2}, {1.5, -2.0})
      .tensor("offset", {2}, {0.5, 4.0})
      .tensor("mean", {2}, {3.0, -1.0})
      .tensor("variance", {2}, {3.75, 0.0});
  set(graph.node("BatchNormalization", {value, "scale", "offset", "mean", "variance"}, output),
      "epsilon", 0.25F);
}

TEST(Folding, TakesBatchNormalisationBeforeTheFirstLayerBetweenAndBehindTheLast) {
  Graph first;
  normalise(first, "x", "n");
  first.dense("n", "y");
  expect_answers(first.read(), [](const Values& x) { return dense(normalised(x)); });
  const conversion::FileScaling file{Eigen::Vector2d(0.5, -2.0), Eigen::Vector2d(4.0, 0.125)};
  expect_answers(
      first.read(), [](const Values& x) { return dense(normalised(x)); }, file);
  Graph between;
  between.dense("x", "h");
  normalise(between, "h", "n");
  between.node("Relu", {"n"}, "a");
  between.dense("a", "y");
  expect_answers(between.read(),
                 [](const Values& x) { return dense(leak(normalised(dense(x)), 0.0, 0.0)); });
  Graph behind_activation;
  behind_activation.dense("x", "h");
  behind_activation.node("Relu", {"h"}, "a");
  normalise(behind_activation, "a", "n");
  behind_activation.dense("n", "y");
  expect_answers(behind_activation.read(),
                 [](const Values& x) { return dense(normalised(leak(dense(x), 0.0, 0.0))); });
  Graph last;
  last.dense("x", "h");
  normalise(last, "h", "y");
  expect_answers(last.read(), [](const Values& x) { return normalised(dense(x)); });
  Graph last_of_all;
  last_of_all.dense("x", "h");
  last_of_all.node("Relu", {"h"}, "a");
  normalise(last_of_all, "a", "y");
  expect_answers(last_of_all.read(),
                 [](const Values& x) { return normalised(leak(dense(x), 0.0, 0.0)); });
}

TEST(Folding, RunsLeaksOfOneSlopeAndOfMany) {
  Graph one;
  one.dense("x", "h");
  set(one.node("LeakyRelu", {"h"}, "a"), "alpha", 0.25F);
  one.dense("a", "y");
  expect_answers(one.read(), [](const Values& x) { return dense(leak(dense(x), 0.25, 0.25)); });
  Graph standard;  // alpha 0.01, and nothing behind it
  standard.dense("x", "h");
  standard.node("LeakyRelu", {"h"}, "y");
  expect_answers(standard.read(), [](const Values& x) { return leak(dense(x), 0.01, 0.01); });
  Graph many;
  many.dense("x", "h");
  many.tensor("slope", {2}, {-0.5, 0.125}).node("PRelu", {"h", "slope"}, "a");
  normalise(many, "a", "n");
  many.node("LeakyRelu", {"n"}, "c");
  many.dense("c", "y");
  expect_answers(many.read(), [](const Values& x) {
    return dense(leak(normalised(leak(dense(x), -0.5, 0.125)), 0.01, 0.01));
  });
}

TEST(Folding, PassesOnWhatKeepsAFlatVector) {
  Graph graph;
  graph.integers("keep", {-1, 2}).integers("copy", {0, -1}).integers("unused", {7, 7, 7});
  graph.tensor("unused_cube", {1, 2, 1}, {1.0, 2.0});
  graph.tensor("unused_nan", {1}, {std::nan("")});
  graph.node("Flatten", {"x"}, "f");
  graph.node("Reshape", {"f", "keep"}, "r");
  graph.dense("r", "h");
  graph.node("Dropout", {"h"}, "d").add_output("mask");
  graph.node("Reshape", {"d", "copy"}, "i");
  graph.node("Relu", {"i"}, "a");
  graph.dense("a", "y");
  expect_answers(graph.read(), [](const Values& x) { return dense(leak(dense(x), 0.0, 0.0)); });
}

TEST(Folding, NamesTheNodeThatItCannotFold) {
  const auto refused = [](const std::function<void(Graph&)>& add, const char* says) {
    Graph graph;
    graph.dense("x", "h");
    add(graph);
    graph.dense("a", "y");
    const std::string text = graph.refusal();
    EXPECT_NE(text.find(says), std::string::npos) << text;
    EXPECT_NE(text.find("node 1 "), std::string::npos) << text;
  };
  refused(
      [](Graph& graph) {
        graph.integers("s", {-1, 1}).node("Reshape", {"h", "s"}, "a");
      },
      "the shape [-1, 1], and only [-1, 2]");
  refused([](Graph& graph) { set(graph.node("Flatten", {"h"}, "a"), "axis", std::int64_t{0}); },
          "joins rows (axis 0)");
  refused(
      [](Graph& graph) {
        normalise(graph, "h", "a");
        set(*graph.proto().mutable_graph()->mutable_node(1), "training_mode", std::int64_t{1});
      },
      "model.eval()");
  refused(
      [](Graph& graph) {
        graph.integers("k", {1, 2}).node("Add", {"h", "k"}, "a");
      },
      "tensor 'k' has elements of type INT64");
  refused([](Graph& graph) { graph.node("Elu", {"h"}, "a"); }, "(operator Elu) is not supported");
  refused(
      [](Graph& graph) {
        normalise(graph, "h", "a");
        graph.proto().mutable_graph()->mutable_initializer(2)->set_data_location(
            onnx::TensorProto::EXTERNAL);
      },
      "tensor 'scale' lies in another file; export the model into one file");
}

}  // namespace
}  // namespace ravencal::test
