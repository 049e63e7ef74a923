// SPDX-License-Identifier: Apache-2.0
#include "bench/step_peers.hpp"

#if defined(RAVENCAL_BENCH_ONNX_RUNTIME)
#include <onnx/onnx_pb.h>
#include <onnxruntime_c_api.h>
#endif

namespace ravencal::bench {

#if defined(RAVENCAL_BENCH_ONNX_RUNTIME)

namespace {

void add_tensor(onnx::GraphProto& graph, const std::string& name,
                std::initializer_list<std::int64_t> dims, const std::vector<float>& values) {
  onnx::TensorProto* tensor = graph.add_initializer();
  tensor->set_name(name);
  tensor->set_data_type(onnx::TensorProto::FLOAT);
  for (const std::int64_t dim : dims) tensor->add_dims(dim);
  tensor->set_raw_data(values.data(), values.size() * sizeof(float));
}

void declare(onnx::ValueInfoProto& info, const std::string& name, std::int64_t width) {
  info.set_name(name);
  auto* type = info.mutable_type()->mutable_tensor_type();
  type->set_elem_type(onnx::TensorProto::FLOAT);
  type->mutable_shape()->add_dim()->set_dim_value(1);
  type->mutable_shape()->add_dim()->set_dim_value(width);
}

std::string serialise(const kernels_test::Network& network) {
  onnx::ModelProto model;
  model.set_ir_version(7);
  model.add_opset_import()->set_version(13);
  onnx::GraphProto& graph = *model.mutable_graph();
  graph.set_name("network");
  declare(*graph.add_input(), "x", network.front().inputs);
  declare(*graph.add_output(), "y", network.back().outputs);
  std::string value = "x";
  for (const auto& layer : network) {
    const bool last = &layer == &network.back();
    const std::string id = std::to_string(&layer - network.data());
    add_tensor(graph, "w" + id, {layer.outputs, layer.inputs}, layer.weights);
    add_tensor(graph, "b" + id, {layer.outputs}, layer.biases);
    onnx::NodeProto* gemm = graph.add_node();
    gemm->set_op_type("Gemm");
    for (const std::string& input : {value, "w" + id, "b" + id}) gemm->add_input(input);
    value = last ? "y" : "s" + id;
    gemm->add_output(value);
    onnx::AttributeProto* transposed = gemm->add_attribute();
    transposed->set_name("transB");
    transposed->set_type(onnx::AttributeProto::INT);
    transposed->set_i(1);
    if (last) break;
    onnx::NodeProto* sigmoid = graph.add_node();
    sigmoid->set_op_type("Sigmoid");
    sigmoid->add_input(value);
    value = "h" + id;
    sigmoid->add_output(value);
  }
  return model.SerializeAsString();
}

/// One session with its tensors over memory of its own.
struct Session {
  const OrtApi* api = OrtGetApiBase()->GetApi(1);
  OrtEnv* env = nullptr;
  OrtSession* session = nullptr;
  OrtValue* x = nullptr;
  OrtValue* y = nullptr;
  std::vector<float> inputs;
  std::vector<float> outputs;
  std::string failure;

  explicit Session(const Task& task) : inputs(task.inputs), outputs(task.network.back().outputs) {
    const std::string model = serialise(task.network);
    OrtSessionOptions* options = nullptr;
    OrtMemoryInfo* memory = nullptr;
    check(api->CreateEnv(ORT_LOGGING_LEVEL_ERROR, "bench", &env));
    check(api->CreateSessionOptions(&options));
    check(api->SetIntraOpNumThreads(options, 1));
    check(api->SetInterOpNumThreads(options, 1));
    check(api->SetSessionGraphOptimizationLevel(options, ORT_ENABLE_ALL));
    check(api->CreateSessionFromArray(env, model.data(), model.size(), options, &session));
    check(api->CreateCpuMemoryInfo(OrtArenaAllocator, OrtMemTypeDefault, &memory));
    if (!failure.empty()) return;
    x = tensor(memory, inputs);
    y = tensor(memory, outputs);
  }

  OrtValue* tensor(const OrtMemoryInfo* memory, std::vector<float>& values) {
    const std::int64_t shape[] = {1, static_cast<std::int64_t>(values.size())};
    OrtValue* value = nullptr;
    check(api->CreateTensorWithDataAsOrtValue(memory, values.data(), values.size() * sizeof(float),
                                              shape, 2, ONNX_TENSOR_ELEMENT_DATA_TYPE_FLOAT,
                                              &value));
    return value;
  }

  void check(OrtStatus* status) {
    if (status != nullptr && failure.empty()) failure = api->GetErrorMessage(status);
  }

  void run() {
    const char* const x_name = "x";
    const char* const y_name = "y";
    api->Run(session, nullptr, &x_name, &x, 1, &y_name, 1, &y);
  }
};

}  // namespace

Peer onnx_runtime_peer(const Task& task) {
  const auto session = std::make_shared<Session>(task);
  Peer peer{"ONNX Runtime f32", float32_bytes(task.network), {}, {}, session->failure};
  peer.step = [session, x = &task.inputs](float* y) {
    std::copy(x->begin(), x->end(), session->inputs.begin());
    session->run();
    std::copy(session->outputs.begin(), session->outputs.end(), y);
  };
  return peer;
}

#else

Peer onnx_runtime_peer(const Task& /*task*/) {
  return {"ONNX Runtime", 0, {}, {}, "not found when this was built (onnxruntime_c_api.h)"};
}

#endif

}  // namespace ravencal::bench
