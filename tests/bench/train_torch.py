#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""Seconds per epoch of the same training in PyTorch: train_torch.py THREADS ROUNDS.

Same networks, loss, penalties, Adam and batches as train_bench; tensors in memory, batches cut by
hand (a DataLoader takes more than twice as long), best of ROUNDS epochs.
"""
import json
import sys
import time

import torch

threads, rounds = int(sys.argv[1]), int(sys.argv[2])
torch.set_num_threads(threads)
torch.manual_seed(1)
BATCH, L1, L2, L2_BIAS, L2_ACTIVITY = 1024, 1e-5, 1e-4, 1e-4, 1e-5


def epoch(layers, optimiser, x, t):
    order = torch.randperm(x.shape[0])
    for begin in range(0, x.shape[0], BATCH):
        rows = order[begin:begin + BATCH]
        a, target = x[rows], t[rows]
        penalty = 0.0
        for layer in layers[:-1]:
            a = torch.sigmoid(layer(a))
            w, b = layer.weight, layer.bias
            penalty = penalty + L1 * w.abs().sum() + L2 * w.square().sum() \
                + L2_BIAS * b.square().sum() + L2_ACTIVITY / a.shape[0] * a.square().sum()
        loss = torch.nn.functional.mse_loss(layers[-1](a), target) + penalty
        optimiser.zero_grad(set_to_none=True)
        loss.backward()
        optimiser.step()


for name, sizes, rows in (("light", (112, 128, 64, 32, 3), 68000),
                          ("paper", (208, 600, 500, 400, 3), 20480)):
    layers = [torch.nn.Linear(i, o) for i, o in zip(sizes[:-1], sizes[1:])]
    parameters = [p for layer in layers for p in layer.parameters()]
    optimiser = torch.optim.Adam(parameters, lr=5e-4, eps=1e-7)
    x, t = torch.randn(rows, sizes[0]), torch.randn(rows, sizes[-1])
    best = 1e9
    for _ in range(rounds):
        start = time.perf_counter()
        epoch(layers, optimiser, x, t)
        best = min(best, time.perf_counter() - start)
    print(json.dumps({"network": name, "threads": threads, "s_per_epoch": round(best, 5)}))
