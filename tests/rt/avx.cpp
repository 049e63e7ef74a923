// SPDX-License-Identifier: Apache-2.0
//
// One instruction of AVX. An emulator of an old processor must refuse it, or it shows nothing.
int main() { asm volatile("vaddps %%ymm0, %%ymm0, %%ymm0" ::: "xmm0"); }
