// SPDX-License-Identifier: Apache-2.0
#include "exchange/decompress.hpp"

#include <fmt/format.h>
#include <lz4frame.h>
#include <zstd.h>

#include <algorithm>
#include <memory>

namespace ravencal::exchange {
namespace {

constexpr std::size_t kStep = std::size_t{1} << 20U;  // bytes by which the output grows

/// Takes from `in`, puts into `out`; sets how many of each. False: the bytes are damaged.
class Zstd {
 public:
  bool step(std::span<const std::uint8_t> in, std::span<std::uint8_t> out, std::size_t& taken,
            std::size_t& put) {
    ZSTD_inBuffer from = {in.data(), in.size(), 0};
    ZSTD_outBuffer to = {out.data(), out.size(), 0};
    const std::size_t result = ZSTD_decompressStream(stream_.get(), &to, &from);
    taken = from.pos;
    put = to.pos;
    return ZSTD_isError(result) == 0;
  }

 private:
  std::unique_ptr<ZSTD_DStream, size_t (*)(ZSTD_DStream*)> stream_{ZSTD_createDStream(),
                                                                   ZSTD_freeDStream};
};

class Lz4 {
 public:
  Lz4() { (void)LZ4F_createDecompressionContext(&context_, LZ4F_VERSION); }
  Lz4(const Lz4&) = delete;
  Lz4& operator=(const Lz4&) = delete;
  ~Lz4() { (void)LZ4F_freeDecompressionContext(context_); }

  bool step(std::span<const std::uint8_t> in, std::span<std::uint8_t> out, std::size_t& taken,
            std::size_t& put) {
    taken = in.size();
    put = out.size();
    return LZ4F_isError(LZ4F_decompress(context_, out.data(), &put, in.data(), &taken, nullptr)) ==
           0;
  }

 private:
  LZ4F_dctx* context_ = nullptr;
};

template <typename Decoder>
core::Result<std::vector<std::uint8_t>> decode(std::span<const std::uint8_t> bytes,
                                               std::uint64_t size) {
  Decoder decoder;
  std::vector<std::uint8_t> out;
  std::size_t done = 0;
  for (;;) {
    // One byte beyond the end shows whether more comes out.
    if (done == out.size())
      out.resize(static_cast<std::size_t>(std::min<std::uint64_t>(size + 1, done + kStep)));
    std::size_t taken = 0;
    std::size_t put = 0;
    if (!decoder.step(bytes, std::span(out).subspan(done), taken, put))
      return core::data_error("its compressed bytes are damaged");
    bytes = bytes.subspan(taken);
    done += put;
    if (done > size || (taken == 0 && put == 0)) break;
  }
  if (done != size) {
    return core::data_error(
        fmt::format("its compressed bytes do not make the {} that it states", size));
  }
  out.resize(done);
  return out;
}

}  // namespace

core::Result<std::vector<std::uint8_t>> decompress(std::span<const std::uint8_t> bytes,
                                                   std::string_view compression,
                                                   std::uint64_t size) {
  if (compression == "zstd") return decode<Zstd>(bytes, size);
  if (compression == "lz4") return decode<Lz4>(bytes, size);
  if (compression.empty()) return std::vector<std::uint8_t>(bytes.begin(), bytes.end());
  return core::data_error(fmt::format("its compression '{}' is neither zstd nor lz4", compression));
}

}  // namespace ravencal::exchange
