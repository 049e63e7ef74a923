#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the model files beside it and expected.json, what their makers say that they compute.

Needs python3-torch, python3-h5py and python3-numpy of Debian 12; the tests do not. ONNX files are
exported by PyTorch itself, one with TensorFlow's operators and names is put together with the onnx
package. Keras is not packaged, so its HDF5 files are written with h5py as Keras 2.15
(tf_keras/src/saving/legacy/hdf5_format.py) and Keras 3 (keras/src/legacy/saving/legacy_h5_format.py)
write them, and what they compute is said by PyTorch: Dense as nn.Linear, GRU as nn.GRU, whose gates
stand in another order (r, z, n) and whose update gate means the same.
"""
import io
import json
import pathlib

import h5py
import numpy as np
import onnx
import onnx.helper as helper
import onnx.numpy_helper as numpy_helper
import torch
from torch import nn

HERE = pathlib.Path(__file__).resolve().parent
torch.manual_seed(7)
torch.set_default_dtype(torch.float32)
INPUTS, OUTPUTS, ROWS = 4, 2, 16
expected = {}


def numbers(tensor):
    return np.asarray(tensor.detach(), dtype=np.float64).tolist()


def remember(name, inputs, outputs):
    expected[name] = {"inputs": numbers(inputs), "outputs": numbers(outputs)}


class Scaled(nn.Module):
    """Scaling inside the graph, as PyTorch users write it."""

    def __init__(self, network):
        super().__init__()
        self.network = network
        self.register_buffer("mean", torch.tensor([20.0, -3.0, 0.5, 100.0]))
        self.register_buffer("scale", torch.tensor([8.0, 2.0, -0.25, 40.0]))
        self.register_buffer("out_mean", torch.tensor([-7.0, 0.01]))
        self.register_buffer("out_scale", torch.tensor([1.5, 0.002]))

    def forward(self, x):
        return self.network((x - self.mean) / self.scale) * self.out_scale + self.out_mean


def export(name, module, **options):
    module.eval()
    sample = torch.randn(1, INPUTS)
    buffer = io.BytesIO()
    torch.onnx.export(module, sample, buffer, input_names=["x"], output_names=["y"],
                      dynamic_axes={"x": {0: "rows"}, "y": {0: "rows"}}, **options)
    (HERE / name).write_bytes(buffer.getvalue())
    x = torch.randn(ROWS, INPUTS) * 30.0 + torch.tensor([20.0, -3.0, 0.5, 100.0])
    remember(name, x, module.double()(x.double()))


def layers(*activations):
    widths = [INPUTS, 24, 18, OUTPUTS]
    parts = []
    for k, activation in enumerate(activations):
        parts.append(nn.Linear(widths[k], widths[k + 1]))
        if activation is not None:
            parts.append(activation())
    return nn.Sequential(*parts)


def tensorflow_like():
    """MatMul and Add with TensorFlow's names, as tf2onnx writes them."""
    rng = np.random.default_rng(5)
    weights = [rng.normal(size=s).astype(np.float32) for s in ((INPUTS, 20), (20, OUTPUTS))]
    biases = [rng.normal(size=w.shape[1]).astype(np.float32) for w in weights]
    constants = {
        "sequential/normalization/Sub/y:0": np.array([[20, -3, 0.5, 100]], np.float32),
        "sequential/normalization/Sqrt:0": np.array([[8, 2, 0.25, 40]], np.float32),
        "sequential/dense/MatMul/ReadVariableOp:0": weights[0],
        "sequential/dense/BiasAdd/ReadVariableOp:0": biases[0],
        "sequential/dense_1/MatMul/ReadVariableOp:0": weights[1],
        "sequential/dense_1/BiasAdd/ReadVariableOp:0": biases[1],
        "scale:0": np.array(0.5, np.float32),
    }
    steps = [("Sub", "sequential/normalization/Sub/y:0"), ("Div", "sequential/normalization/Sqrt:0"),
             ("MatMul", "sequential/dense/MatMul/ReadVariableOp:0"),
             ("Add", "sequential/dense/BiasAdd/ReadVariableOp:0"), ("Tanh", None),
             ("MatMul", "sequential/dense_1/MatMul/ReadVariableOp:0"),
             ("Add", "sequential/dense_1/BiasAdd/ReadVariableOp:0"), ("Mul", "scale:0"), ("Identity", None)]
    nodes, value = [], "normalization_input"
    for k, (op, constant) in enumerate(steps):
        inputs = [value] if constant is None else [value, constant]
        value = "Identity:0" if k + 1 == len(steps) else f"sequential/step_{k}/{op}:0"
        nodes.append(helper.make_node(op, inputs, [value], name=f"StatefulPartitionedCall/{op}_{k}"))
    graph = helper.make_graph(
        nodes, "tf2onnx",
        [helper.make_tensor_value_info("normalization_input", onnx.TensorProto.FLOAT, ["unk__8", INPUTS])],
        [helper.make_tensor_value_info("Identity:0", onnx.TensorProto.FLOAT, ["unk__9", OUTPUTS])],
        [numpy_helper.from_array(v, n) for n, v in constants.items()])
    model = helper.make_model(graph, producer_name="tf2onnx", opset_imports=[helper.make_opsetid("", 15)])
    onnx.checker.check_model(model)
    (HERE / "tensorflow.onnx").write_bytes(model.SerializeToString())
    x = rng.normal(size=(ROWS, INPUTS)) * 20.0
    hidden = np.tanh((x - [20, -3, 0.5, 100]) / [8, 2, 0.25, 40] @ weights[0].astype(float) + biases[0])
    remember("tensorflow.onnx", torch.tensor(x), torch.tensor((hidden @ weights[1].astype(float) + biases[1]) * 0.5))


def write_keras(path, config, weights, version, prefix, suffix):
    """`weights`: layer name -> list of (path below the layer, array)."""
    with h5py.File(path, "w") as file:
        file.attrs["backend"] = "tensorflow"
        file.attrs["keras_version"] = version
        file.attrs["model_config"] = json.dumps(config) if suffix else json.dumps(config).encode("utf8")
        group = file.create_group("model_weights")
        group.attrs["backend"] = b"tensorflow"
        group.attrs["keras_version"] = version.encode("utf8")
        names = [layer["config"]["name"] for layer in config["config"]["layers"]]
        group.attrs["layer_names"] = [name.encode("utf8") for name in names]
        for name in sorted(names):
            sub = group.create_group(name)
            values = [(f"{prefix}{name}/{role}{suffix}", v) for role, v in weights.get(name, [])]
            sub.attrs["weight_names"] = np.array([n.encode("utf8") for n, _ in values]) if values else np.zeros(0)
            for weight_name, value in values:
                sub.create_dataset(weight_name, data=value)
        group.create_group("top_level_model_weights").attrs["weight_names"] = np.zeros(0)


def dense_config(name, units, activation):
    return {"class_name": "Dense", "config": {
        "name": name, "trainable": True, "dtype": "float32", "units": units, "activation": activation,
        "use_bias": True, "kernel_regularizer": {"class_name": "L1L2", "config": {"l1": 1e-5, "l2": 1e-4}}}}


def dense_weights(linear):
    return [("kernel", linear.weight.detach().numpy().T), ("bias", linear.bias.detach().numpy())]


def keras2_dense():
    """Keras 2.15, Sequential: Dense sigmoid, Dropout, Dense relu, Dense linear."""
    net = layers(nn.Sigmoid, nn.ReLU, None)
    config = {"class_name": "Sequential", "config": {"name": "sequential", "layers": [
        {"class_name": "InputLayer", "config": {"batch_input_shape": [None, INPUTS], "dtype": "float32",
                                                "sparse": False, "ragged": False, "name": "dense_input"}},
        dense_config("dense", 24, "sigmoid"),
        {"class_name": "Dropout", "config": {"name": "dropout", "rate": 0.1}},
        dense_config("dense_1", 18, "relu"), dense_config("dense_2", OUTPUTS, "linear")]}}
    weights = {"dense": dense_weights(net[0]), "dense_1": dense_weights(net[2]), "dense_2": dense_weights(net[4])}
    write_keras(HERE / "keras2_dense.h5", config, weights, "2.15.0", "", ":0")
    x = torch.randn(ROWS, INPUTS)
    remember("keras2_dense.h5", x, net.double()(x.double()))


def keras3_gru():
    """Keras 3, Functional: GRU over 8 samples, Dense sigmoid, Dense linear."""
    units, samples = 20, 8
    gru, hidden, out = nn.GRU(INPUTS, units, batch_first=True), nn.Linear(units, 12), nn.Linear(12, OUTPUTS)

    def keras_gates(matrix):  # r, z, n -> z, r, h
        r, z, n = matrix.detach().numpy().reshape(3, units, -1)
        return np.concatenate([z, r, n]).squeeze()

    def node(before):
        keys = {"shape": [None, 1], "dtype": "float32", "keras_history": [before, 0, 0]}
        return [{"args": [{"class_name": "__keras_tensor__", "config": keys}], "kwargs": {}}]

    policy = {"module": "keras", "class_name": "DTypePolicy", "config": {"name": "float32"}}
    config = {"class_name": "Functional", "config": {"name": "functional", "trainable": True, "layers": [
        {"class_name": "InputLayer", "name": "window", "inbound_nodes": [], "config": {
            "batch_shape": [None, samples, INPUTS], "dtype": "float32", "name": "window"}},
        {"class_name": "GRU", "name": "gru", "inbound_nodes": node("window"), "config": {
            "name": "gru", "dtype": policy, "return_sequences": False, "return_state": False,
            "go_backwards": False, "stateful": False, "unroll": False, "units": units,
            "activation": "tanh", "recurrent_activation": "sigmoid", "use_bias": True, "reset_after": True}},
        dict(dense_config("dense", 12, "sigmoid"), name="dense", inbound_nodes=node("gru")),
        dict(dense_config("dense_1", OUTPUTS, "linear"), name="dense_1", inbound_nodes=node("dense"))],
        "input_layers": [["window", 0, 0]], "output_layers": [["dense_1", 0, 0]]}}
    weights = {
        "gru": [("gru_cell/kernel", keras_gates(gru.weight_ih_l0).T),
                ("gru_cell/recurrent_kernel", keras_gates(gru.weight_hh_l0).T),
                ("gru_cell/bias", np.stack([keras_gates(gru.bias_ih_l0), keras_gates(gru.bias_hh_l0)]))],
        "dense": dense_weights(hidden), "dense_1": dense_weights(out)}
    write_keras(HERE / "keras3_gru.h5", config, weights, "3.4.1", "", "")
    x = torch.randn(ROWS, samples, INPUTS)
    last = gru.double()(x.double())[1][0]
    remember("keras3_gru.h5", x, out.double()(torch.sigmoid(hidden.double()(last))))


def scaling_files():
    scaling = {
        "features": ["jpos.shoulder", "jpos.elbow", "tau.elbow", "mpos.elbow"],
        "feature_units": "profile",
        "input_mean": [20.0, -3.0, 0.5, 100.0], "input_scale": [8.0, 2.0, 0.25, 40.0],
        "input_min": [-10.0, -12.0, -1.0, -60.0], "input_max": [50.0, 6.0, 2.0, 260.0],
        "output_joints": ["shoulder", "insertion"], "output_units": ["deg", "m"],
        "output_mean": [-7.0, 0.01], "output_scale": [1.5, 0.002], "row_period_s": 0.01}
    (HERE / "scaling.json").write_text(json.dumps(scaling, indent=1) + "\n")
    np.savez(HERE / "scaling.npz", **{k: np.asarray(v) for k, v in scaling.items()})
    np.savez_compressed(HERE / "scaling_compressed.npz", **{k: np.asarray(v) for k, v in scaling.items()})


if __name__ == "__main__":
    export("torch_plain.onnx", layers(nn.Sigmoid, nn.ReLU, None), opset_version=13)
    export("torch_scaled.onnx", Scaled(layers(nn.Tanh, nn.Sigmoid, None)), opset_version=9)
    export("torch_unfolded.onnx", Scaled(layers(nn.ReLU, nn.Tanh, None)), opset_version=16,
           do_constant_folding=False)
    export("torch_leaky.onnx", layers(nn.LeakyReLU, nn.ReLU, None), opset_version=13)
    del expected["torch_leaky.onnx"]  # its operator is not supported: the test wants it named
    tensorflow_like()
    keras2_dense()
    keras3_gru()
    scaling_files()
    (HERE / "expected.json").write_text(json.dumps(expected) + "\n")
