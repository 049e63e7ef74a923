// SPDX-License-Identifier: Apache-2.0
//
// The two vocabularies that training, files and the real-time plugin share. Their numbers are
// stored in blobs and never change. Free of the standard library's owning types, so that the
// plugin may include it.
#pragma once

#include <cstdint>

namespace ravencal::model {

/// How an input is made from a channel.
enum class Transform : std::uint8_t {
  kValue = 0,  ///< the channel now
  kLag = 1,    ///< the channel some rows ago
  kPlay = 2,   ///< play operator of the channel: the memory of a cable with slack
};

/// What a layer applies to each of its sums.
enum class Activation : std::uint8_t { kLinear = 0, kSigmoid = 1, kTanh = 2, kRelu = 3 };

}  // namespace ravencal::model
