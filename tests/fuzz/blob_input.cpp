// SPDX-License-Identifier: Apache-2.0
//
// The bytes as they are, and again with right sizes and checksums, so that the checks behind those
// are reached. Whatever opens is read to the last byte; one in 64 also goes through the tools'
// decoder and encoder, which are a hundred times slower.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "fuzz/inputs.hpp"
#include "model/blob_view.hpp"
#include "model/blob_writer.hpp"
#include "unit/blob_sample.hpp"

namespace ravencal::fuzz {
namespace {

namespace blob = model::blob;
using model::BlobView;

void put_u32(std::byte* at, std::size_t value) {
  for (unsigned i = 0; i < 4; ++i) at[i] = static_cast<std::byte>((value >> (8 * i)) & 0xFFU);
}

void repair(std::vector<std::byte>& bytes) {
  if (bytes.size() < blob::kFirstHeaderBytes + blob::kTrailerBytes) return;
  put_u32(bytes.data() + blob::kFileBytesAt, bytes.size());
  std::byte* const trailer = bytes.data() + bytes.size() - blob::kTrailerBytes;
  if (blob::load_u32(trailer + blob::kSignatureKindAt) == blob::kEd25519) {
    put_u32(trailer + blob::kSignatureChecksumAt,
            blob::crc32c(trailer + blob::kSignatureAt, blob::kSignatureBytes));
  }
  test::repair_checksum(bytes);
}

void demand(bool kept) { promise(kept, "the reader lets no such number through"); }

void read_values(const BlobView& view) {
  for (std::size_t i = 0; i < view.feature_count(); ++i) {
    demand(!view.feature(i).channel.empty());
    demand(std::isfinite(view.input_mean(i)) && view.input_scale(i) > 0.0);
    demand(view.input_min(i) <= view.input_max(i));
  }
  for (std::size_t l = 0; l < view.layer_count(); ++l) {
    const model::packed::PackedLayer layer = view.network().layer(l);
    for (std::uint32_t o = 0; o < layer.outputs; ++o) {
      demand(std::isfinite(view.network().bias(layer, o)));
      for (std::uint32_t i = 0; i < layer.inputs; ++i) {
        demand(!std::isnan(view.network().weight(layer, o, i)));
      }
    }
  }
  for (std::size_t k = 0; k < view.trust_rank(); ++k) {
    demand(view.trust_inverse_variance(k) > 0.0F);
    for (std::size_t i = 0; i < view.feature_count(); ++i) {
      demand(std::abs(view.trust_direction(k, i)) < 1.01F);
    }
  }
  for (std::size_t j = 0; j < view.output_count(); ++j) {
    demand(!view.output(j).joint.empty() && view.self_test_tolerance(j) > 0.0);
    for (std::size_t row = 0; row < view.self_test_count(); ++row) {
      demand(std::isfinite(view.self_test_output(row, j)));
    }
  }
  demand(view.arm() <= model::Arm::kGreen);
  demand(view.coordinates() <= model::Coordinates::kCorrected);
  demand(view.robot().size() < blob::kOriginTextBytes);
  demand(view.controller().size() < blob::kOriginTextBytes);
  demand(std::isfinite(view.loop().gain_margin) && view.loop().phase_margin_rad >= 0.0F);
  for (const auto group :
       {model::LoopGroup::kTorque, model::LoopGroup::kVelocity, model::LoopGroup::kDesired}) {
    for (std::size_t j = 0; j < view.output_count(); ++j) {
      demand(view.loop_gain(group, j) >= 0.0F && std::isfinite(view.loop_gain(group, j)));
    }
  }
  demand(!view.provenance().empty());
  demand(view.signed_bytes().size() + blob::kSignatureBytes < view.file_bytes());
}

void read_everything(std::span<const std::byte> bytes) {
  BlobView view;
  if (!BlobView::open(bytes, view).ok()) return;
  read_values(view);
  if (view.checksum() % 64 != 0) return;
  // The decoder may refuse what the view accepts only for names and JSON, and the encoder what
  // overflows in its self-test; neither may crash.
  const auto model = model::decode_blob(bytes, "fuzz");
  if (model.ok()) (void)model::encode_blob(*model).ok();
}

}  // namespace

void try_blob(Bytes input) {
  static std::vector<std::byte> bytes;
  const auto* const first = reinterpret_cast<const std::byte*>(input.data());
  bytes.assign(first, first + input.size());
  read_everything(bytes);
  repair(bytes);
  read_everything(bytes);
}

}  // namespace ravencal::fuzz
