// SPDX-License-Identifier: Apache-2.0
#include "model/blob_writer.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/catalogue.hpp"
#include "core/joint_layout.hpp"
#include "core/whole_file.hpp"
#include "model/blob_format.hpp"
#include "model/blob_view.hpp"
#include "model/kernel_promise.hpp"

namespace ravencal::model {

using namespace blob;

namespace {

/// A growing little-endian file image.
class ByteWriter {
 public:
  [[nodiscard]] std::size_t size() const { return bytes_.size(); }
  void u8(std::uint8_t value) { bytes_.push_back(std::byte{value}); }
  void u16(std::uint16_t value) { little_endian(value, 2); }
  void u32(std::size_t value) { little_endian(value, 4); }
  void u64(std::uint64_t value) { little_endian(value, 8); }
  void f32(float value) { little_endian(std::bit_cast<std::uint32_t>(value), 4); }
  void f64(double value) { u64(std::bit_cast<std::uint64_t>(value)); }
  void zeros_to(std::size_t size) { bytes_.resize(size); }
  void text(std::string_view value, std::size_t capacity) {
    const std::size_t end = size() + capacity;
    for (const char c : value) u8(static_cast<std::uint8_t>(c));
    zeros_to(end);
  }
  void copy(std::span<const std::byte> more) {
    bytes_.insert(bytes_.end(), more.begin(), more.end());
  }
  void align() { zeros_to(aligned(size())); }
  void patch_u32(std::size_t at, std::size_t value) {
    for (std::size_t i = 0; i < 4; ++i) {
      bytes_[at + i] = static_cast<std::byte>((value >> (8 * i)) & 0xFFU);
    }
  }
  [[nodiscard]] const std::byte* data() const { return bytes_.data(); }
  std::vector<std::byte> take() { return std::move(bytes_); }

 private:
  void little_endian(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) u8(static_cast<std::uint8_t>(value >> (8 * i)));
  }
  std::vector<std::byte> bytes_;
};

struct SelfTest {
  Eigen::MatrixXf inputs;     ///< [features x rows]
  Eigen::MatrixXd outputs;    ///< [outputs x rows]
  Eigen::VectorXd tolerance;  ///< [outputs]
};

/// What is made from a model for its blob.
struct Contents {
  packed::Precision precision;
  std::vector<std::byte> network;
  SelfTest test;
};

/// The mean row, the corners of the trained range along its diagonal, and rows in between chosen by
/// a fixed low-discrepancy sequence (multiples of the golden ratio), so that the same model always
/// gives the same bytes.
SelfTest make_self_test(const CalibrationModel& model) {
  constexpr Eigen::Index kRows = 8;
  constexpr double kGolden = 0.6180339887498949;
  const auto n = static_cast<Eigen::Index>(model.features.size());
  SelfTest test;
  test.inputs.resize(n, kRows);
  for (Eigen::Index row = 0; row < kRows; ++row) {
    for (Eigen::Index i = 0; i < n; ++i) {
      const double low = model.input_min[i];
      const double high = model.input_max[i];
      const double along = std::fmod(static_cast<double>(row * n + i + 1) * kGolden, 1.0);
      const double value = row == 0   ? model.input.mean[i]
                           : row == 1 ? low
                           : row == 2 ? high
                                      : low + (high - low) * along;
      // Rounding to float must not leave the range that the plugin clamps to.
      test.inputs(i, row) =
          std::clamp(static_cast<float>(value), static_cast<float>(low), static_cast<float>(high));
    }
  }
  const KernelPromise promise = kernel_promise(model, test.inputs);
  test.outputs = promise.outputs;
  // A rounding of the output's scale on top, because a blob holds no tolerance of zero.
  test.tolerance = promise.error.rowwise().maxCoeff() + std::ldexp(1.0, -24) * model.output.scale;
  return test;
}

core::Status check_text(std::string_view what, std::string_view value, std::size_t capacity) {
  const bool printable = std::all_of(value.begin(), value.end(), [](char c) {
    return static_cast<unsigned char>(c) > 0x20 && static_cast<unsigned char>(c) < 0x7F;
  });
  if (value.empty() || value.size() >= capacity || !printable) {
    return core::data_error(fmt::format(
        "{} '{}' cannot be stored: a blob holds 1 to {} printable ASCII characters without blanks",
        what, value, capacity - 1));
  }
  return {};
}

/// A name of the origin; it may be empty and contain blanks.
core::Status check_origin_text(std::string_view what, std::string_view value) {
  const bool printable = std::all_of(value.begin(), value.end(), [](char c) {
    return static_cast<unsigned char>(c) >= 0x20 && static_cast<unsigned char>(c) < 0x7F;
  });
  if (value.size() < kOriginTextBytes && printable) return {};
  return core::data_error(
      fmt::format("the {}'s name '{}' cannot be stored: a blob holds up to {} printable ASCII "
                  "characters",
                  what, value, kOriginTextBytes - 1));
}

core::Status check_shapes(const CalibrationModel& model) {
  const auto n = static_cast<Eigen::Index>(model.features.size());
  const auto m = static_cast<Eigen::Index>(model.outputs.size());
  if (model.input.mean.size() != n || model.input.scale.size() != n ||
      model.input_min.size() != n || model.input_max.size() != n) {
    return core::data_error(
        fmt::format("the model has {} inputs, but scaling or ranges for another number", n));
  }
  if (model.output.mean.size() != m || model.output.scale.size() != m) {
    return core::data_error(
        fmt::format("the model has {} outputs, but scaling for another number", m));
  }
  if (model.trust &&
      (model.trust->directions.cols() != n ||
       model.trust->inverse_variance.size() != model.trust->directions.rows() ||
       model.trust->directions.rows() < 1 || model.trust->directions.rows() > kMaxTrustRank)) {
    return core::data_error(
        fmt::format("the model has {} inputs, but a trust region of another shape", n));
  }
  if (model.loop_gains && (model.loop_gains->by_group.rows() != m ||
                           model.loop_gains->by_group.cols() != kLoopGroupCount)) {
    return core::data_error(
        fmt::format("the model has {} outputs, but loop gains for another number", m));
  }
  Eigen::Index inputs = n;
  for (std::size_t l = 0; l < model.layers.size(); ++l) {
    const DenseLayer& layer = model.layers[l];
    const bool is_recurrent = layer.kind == packed::LayerKind::kGruRecurrent;
    if (is_recurrent) inputs = layer.weights.cols();  // its own state; pack() checks the shape
    if (layer.weights.cols() != inputs || layer.biases.size() != layer.weights.rows()) {
      return core::data_error(
          fmt::format("layer {} has weights {} x {} and {} biases; {} inputs arrive", l + 1,
                      layer.weights.rows(), layer.weights.cols(), layer.biases.size(), inputs));
    }
    if (!is_recurrent) inputs = layer.weights.rows();
  }
  if (inputs != m) {
    return core::data_error(
        fmt::format("the last layer has {} outputs, the model names {}", inputs, m));
  }
  return {};
}

std::uint8_t slot_of(std::string_view joint) {
  const auto it = std::find(core::kSlotNames.begin(), core::kSlotNames.end(), joint);
  return it == core::kSlotNames.end() ? kNoSlot
                                      : static_cast<std::uint8_t>(it - core::kSlotNames.begin());
}

void write_vector(ByteWriter& out, const Eigen::VectorXd& values) {
  for (const double value : values) out.f64(value);
}

/// 1 + the input that is the position of a mean over travel; 0 for others, and where it is missing.
std::size_t number_of_position(const CalibrationModel& model, const FeatureSpec& feature) {
  if (!is_travel_mean(feature.transform)) return 0;
  const auto position = position_of(model.features, feature);
  return position ? *position + 1 : 0;
}

core::Status check_position(const CalibrationModel& model, const FeatureSpec& feature) {
  if (!is_travel_mean(feature.transform) || number_of_position(model, feature) != 0) return {};
  return core::data_error(fmt::format(
      "input '{}' goes by the travel of '{}', which is no input of the model: add {} to "
      "the features",
      feature.text(), feature.along, feature.along));
}

/// The number that makes the input from its channel.
float parameter_of(const FeatureSpec& feature) {
  if (feature.transform == Transform::kPlay) return feature.play_half_width;
  if (is_mean(feature.transform)) return feature.time_constant_s;
  return is_travel_mean(feature.transform) ? feature.travel_si : 0.0F;
}

void write_features(ByteWriter& out, const CalibrationModel& model) {
  for (const FeatureSpec& feature : model.features) {
    const auto index = core::catalogue_index_of(feature.channel);
    out.u16(index ? static_cast<std::uint16_t>(*index) : kNoCatalogueIndex);
    out.u8(static_cast<std::uint8_t>(feature.transform));
    out.u8(0);
    out.u32(feature.transform == Transform::kLag ? feature.lag_rows : 0);
    out.f32(parameter_of(feature));
    out.u32(number_of_position(model, feature));
    out.text(feature.channel, kFeatureNameBytes);
  }
}

void write_trust(ByteWriter& out, const TrustRegion& trust) {
  const std::size_t start = out.size();
  out.f32(trust.inverse_residual_variance);
  out.f32(trust.full_distance);
  out.f32(trust.none_distance);
  out.zeros_to(start + kTrustVariancesAt);
  for (const float inverse : trust.inverse_variance) out.f32(inverse);
  out.zeros_to(start + kTrustDirectionsAt);
  for (Eigen::Index k = 0; k < trust.directions.rows(); ++k) {
    for (const float value : trust.directions.row(k)) out.f32(value);
    out.align();
  }
}

void write_outputs(ByteWriter& out, const CalibrationModel& model) {
  for (const OutputSpec& output : model.outputs) {
    const std::size_t end = out.size() + kOutputBytes;
    out.u8(slot_of(output.joint));
    out.zeros_to(end - kOutputBytes + kOutputJointAt);
    out.text(output.joint, kOutputJointBytes);
    out.text(output.estimate_channel, kOutputChannelBytes);
    out.text(output.unit, kOutputUnitBytes);
    out.zeros_to(end);
  }
}

void write_self_test(ByteWriter& out, const SelfTest& test) {
  write_vector(out, test.tolerance);
  for (Eigen::Index row = 0; row < test.outputs.cols(); ++row) {
    write_vector(out, test.outputs.col(row));
  }
  for (Eigen::Index row = 0; row < test.inputs.cols(); ++row) {
    for (const float value : test.inputs.col(row)) out.f32(value);
  }
}

void write_loop(ByteWriter& out, const LoopGains& gains) {
  const std::size_t start = out.size() - kLoopFlagsAt;
  out.u32(kLoopGainsKnown | (gains.margins ? kLoopMarginsKnown : 0));
  out.u32(gains.rows);
  if (gains.margins) {
    out.f32(static_cast<float>(std::min(gains.margins->gain, static_cast<double>(kMaxGainMargin))));
    out.f32(static_cast<float>(gains.margins->phase_rad));
  }
  out.zeros_to(start + kLoopGainsAt);
  for (Eigen::Index group = 0; group < gains.by_group.cols(); ++group) {
    const std::size_t end = out.size() + kLoopLanes * sizeof(float);
    for (const double gain : gains.by_group.col(group)) out.f32(static_cast<float>(gain));
    out.zeros_to(end);
  }
}

/// What minor version 1 appended.
void write_appended(ByteWriter& out, const CalibrationModel& model) {
  out.u32(static_cast<std::size_t>(model.origin.arm));
  out.u32(static_cast<std::size_t>(model.origin.coordinates));
  out.text(model.origin.robot, kOriginTextBytes);
  out.text(model.origin.controller, kOriginTextBytes);
  if (model.loop_gains) write_loop(out, *model.loop_gains);
  out.zeros_to(kHeaderBytes);
}

/// The least that can say what the model holds, so that older readers take what they can.
std::uint16_t minor_of(const CalibrationModel& model) {
  const bool has_means =
      std::any_of(model.features.begin(), model.features.end(), [](const FeatureSpec& feature) {
        return is_mean(feature.transform) || is_travel_mean(feature.transform);
      });
  return has_means ? kMinorOfMeans : kMinorOfHeader;
}

void write_header(ByteWriter& out, const CalibrationModel& model, const Contents& contents) {
  for (const std::uint8_t byte : kMagic) out.u8(byte);
  out.u16(kMajor);
  out.u16(minor_of(model));
  out.u32(kHeaderBytes);
  out.u32(0);  // file size, known at the end
  out.u32(static_cast<std::size_t>(contents.precision));
  out.u32(model.features.size());
  out.u32(model.layers.size());
  out.u32(model.outputs.size());
  out.u32(static_cast<std::size_t>(contents.test.inputs.cols()));
  out.u32(model.trust ? static_cast<std::size_t>(model.trust->directions.rows()) : 0);
  out.f64(model.row_period_s);
  out.zeros_to(kFirstHeaderBytes);
  write_appended(out, model);
}

void write_section(ByteWriter& out, Section section, const CalibrationModel& model,
                   const Contents& contents) {
  switch (section) {
    case kFeatures:
      return write_features(out, model);
    case kInputScaling:
      write_vector(out, model.input.mean);
      return write_vector(out, model.input.scale);
    case kInputRange:
      write_vector(out, model.input_min);
      return write_vector(out, model.input_max);
    case kNetwork:
      return out.copy(contents.network);
    case kTrust:
      return model.trust ? write_trust(out, *model.trust) : void();
    case kOutputScaling:
      write_vector(out, model.output.mean);
      return write_vector(out, model.output.scale);
    case kOutputs:
      return write_outputs(out, model);
    case kSelfTest:
      return write_self_test(out, contents.test);
    case kProvenance: {
      const std::string text = nlohmann::json(model.provenance)
                                   .dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
      return out.text(text == "null" ? "{}" : text, text == "null" ? 2 : text.size());
    }
    case kSectionCount:
      return;
  }
}

}  // namespace

core::Result<std::vector<std::byte>> encode_blob(const CalibrationModel& model,
                                                 const Packing& packing) {
  RAVENCAL_RETURN_IF_ERROR(check_shapes(model));
  for (const FeatureSpec& feature : model.features) {
    RAVENCAL_RETURN_IF_ERROR(check_text("channel", feature.channel, kFeatureNameBytes));
    RAVENCAL_RETURN_IF_ERROR(check_position(model, feature));
  }
  for (const OutputSpec& output : model.outputs) {
    RAVENCAL_RETURN_IF_ERROR(check_text("joint", output.joint, kOutputJointBytes));
    RAVENCAL_RETURN_IF_ERROR(check_text("channel", output.estimate_channel, kOutputChannelBytes));
    RAVENCAL_RETURN_IF_ERROR(check_text("unit", output.unit, kOutputUnitBytes));
  }
  RAVENCAL_RETURN_IF_ERROR(check_origin_text("robot", model.origin.robot));
  RAVENCAL_RETURN_IF_ERROR(check_origin_text("controller", model.origin.controller));
  Contents contents{packing.precision, {}, {}};
  RAVENCAL_ASSIGN_OR_RETURN(contents.network, pack_layers(model, packing));
  CalibrationModel as_packed = model;
  RAVENCAL_ASSIGN_OR_RETURN(as_packed.layers, unpack_layers(contents.network));
  contents.test = make_self_test(as_packed);
  ByteWriter out;
  write_header(out, model, contents);
  for (std::size_t s = 0; s < kSectionCount; ++s) {
    const std::size_t offset = out.size();
    write_section(out, static_cast<Section>(s), model, contents);
    out.patch_u32(kSectionTableAt + s * kSectionEntryBytes, offset);
    out.patch_u32(kSectionTableAt + s * kSectionEntryBytes + 4, out.size() - offset);
    out.align();
  }
  const std::size_t trailer = out.size();
  out.patch_u32(kFileBytesAt, trailer + kTrailerBytes);
  out.u32(crc32c(out.data(), trailer));
  out.zeros_to(trailer + kTrailerBytes);

  std::vector<std::byte> bytes = out.take();
  BlobView view;
  const BlobCheck check = BlobView::open(bytes, view);
  if (!check.ok()) {
    return core::data_error(fmt::format("the model cannot be stored as a blob: {} (byte {})",
                                        describe(check.status), check.offset));
  }
  return bytes;
}

core::Status write_blob(const CalibrationModel& model, const std::filesystem::path& path,
                        const Packing& packing) {
  RAVENCAL_ASSIGN_OR_RETURN(const std::vector<std::byte> bytes, encode_blob(model, packing));
  return write_blob(bytes, path);
}

core::Status write_blob(std::span<const std::byte> bytes, const std::filesystem::path& path) {
  return core::write_whole_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace ravencal::model
