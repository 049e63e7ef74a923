// SPDX-License-Identifier: Apache-2.0
#include "conversion/kernel_check.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "kernels/forward.hpp"
#include "model/blob_status.hpp"
#include "model/blob_view.hpp"

namespace ravencal::conversion {
namespace {

struct Free {
  void operator()(std::byte* memory) const { std::free(memory); }
};
using Lines = std::unique_ptr<std::byte[], Free>;

/// Zeroed memory that begins on a line, as kernels read it.
Lines lines(std::size_t bytes) {
  constexpr std::size_t kLine = kernels::kLineBytes;
  const std::size_t whole = (bytes + kLine - 1) / kLine * kLine;
  Lines memory(static_cast<std::byte*>(std::aligned_alloc(kLine, whole)));
  std::memset(memory.get(), 0, whole);
  return memory;
}

/// A blob's network with the memory of its kernels.
class Network {
 public:
  explicit Network(const model::BlobView& view) : view_(view) {
    const std::size_t bytes = view.network().header().bytes;
    network_ = lines(bytes);
    std::memcpy(network_.get(), view.network().base, bytes);
    packed_.base = network_.get();
    scratch_ =
        lines(kernels::scratch_bytes(packed_.header().widest) + kernels::memory_bytes(packed_, 1));
  }

  /// Outputs of a row of the self-test, SI units; a GRU sees the row held over its window.
  std::vector<double> run(kernels::Isa isa, std::size_t row) {
    std::vector<float> scaled(view_.feature_count());
    for (std::size_t i = 0; i < scaled.size(); ++i) {
      const auto inverse_scale = static_cast<float>(1.0 / view_.input_scale(i));
      scaled[i] =
          (view_.self_test_input(row, i) - static_cast<float>(view_.input_mean(i))) * inverse_scale;
    }
    std::vector<float> outputs(view_.output_count());
    const kernels::PackedLayer gru = packed_.recurrence();
    const std::uint32_t passes = gru.window == 0 ? 1 : (gru.window - 1U) * gru.stride_rows + 1U;
    kernels::clear_memory(packed_, 1, scratch_.get());
    for (std::uint32_t pass = 0; pass < passes; ++pass) {
      kernels::forward_for(isa)(packed_, scaled.data(), outputs.data(), scratch_.get());
    }
    std::vector<double> outputs_si(outputs.size());
    for (std::size_t j = 0; j < outputs.size(); ++j) {
      outputs_si[j] = static_cast<double>(outputs[j] * static_cast<float>(view_.output_scale(j)) +
                                          static_cast<float>(view_.output_mean(j)));
    }
    return outputs_si;
  }

 private:
  const model::BlobView& view_;
  Lines network_;
  Lines scratch_;
  kernels::PackedView packed_;
};

}  // namespace

core::Result<std::vector<std::string>> check_kernels(std::span<const std::byte> blob,
                                                     const std::string& name) {
  model::BlobView view;
  const model::BlobCheck check = model::BlobView::open(blob, view);
  if (!check.ok()) {
    return core::data_error(
        fmt::format("{}: {} (byte {})", name, model::describe(check.status), check.offset));
  }
  Network network(view);
  std::vector<std::string> names;
  for (std::uint8_t level = 0; level < kernels::kIsaCount; ++level) {
    const auto isa = static_cast<kernels::Isa>(level);
    if (!kernels::is_supported(isa)) continue;
    for (std::size_t row = 0; row < view.self_test_count(); ++row) {
      const std::vector<double> outputs = network.run(isa, row);
      for (std::size_t j = 0; j < outputs.size(); ++j) {
        const double off = outputs[j] - view.self_test_output(row, j);
        if (std::abs(off) <= view.self_test_tolerance(j)) continue;
        return core::data_error(fmt::format(
            "{}: not written: the {} code of the plugin is off by {:.3g} {} for {} in row {} of "
            "the self-test, allowed {:.3g}; the plugin would refuse these weights. It is a fault "
            "of this build: please report it with the model",
            name, kernels::name_of(isa), off, view.output(j).unit, view.output(j).joint, row,
            view.self_test_tolerance(j)));
      }
    }
    names.emplace_back(kernels::name_of(isa));
  }
  return names;
}

}  // namespace ravencal::conversion
