// SPDX-License-Identifier: Apache-2.0
#include "model/blob_status.hpp"

namespace ravencal::model {

const char* describe(BlobStatus status) noexcept {
  switch (status) {
    case BlobStatus::kOk:
      return "valid";
    case BlobStatus::kTooShort:
      return "the file is shorter than its header says";
    case BlobStatus::kBadMagic:
      return "this is not a ravencal weight blob";
    case BlobStatus::kVersion:
      return "the format version is not one that this build reads";
    case BlobStatus::kSize:
      return "the sizes in the header disagree with the file";
    case BlobStatus::kChecksum:
      return "the checksum does not match: the file is damaged";
    case BlobStatus::kSignature:
      return "it is signed in a way that this build does not know";
    case BlobStatus::kReserved:
      return "a reserved byte is not zero";
    case BlobStatus::kSection:
      return "a section is not where or not as long as the counts demand";
    case BlobStatus::kCount:
      return "a count is zero or above its limit";
    case BlobStatus::kPrecision:
      return "the weights have a precision that this build does not read";
    case BlobStatus::kFeature:
      return "an input has an invalid channel, transform or parameter";
    case BlobStatus::kScaling:
      return "a scaling value is not finite or not positive";
    case BlobStatus::kRange:
      return "a trained range is not finite or empty";
    case BlobStatus::kTrust:
      return "the directions, variances or distances of the trust section are out of range";
    case BlobStatus::kLayer:
      return "the layers do not fit together";
    case BlobStatus::kWeight:
      return "a weight is not finite";
    case BlobStatus::kOutput:
      return "an output has an invalid joint, channel or unit";
    case BlobStatus::kPeriod:
      return "the row period is out of range";
    case BlobStatus::kSelfTest:
      return "a self-test value is not finite";
    case BlobStatus::kProvenance:
      return "the provenance is not text";
    case BlobStatus::kOrigin:
      return "the arm, the coordinates or a name of the origin is invalid";
    case BlobStatus::kLoopGain:
      return "a loop gain or margin is out of range";
  }
  return "unknown reason";
}

}  // namespace ravencal::model
