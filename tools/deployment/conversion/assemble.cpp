// SPDX-License-Identifier: Apache-2.0
#include "conversion/assemble.hpp"

#include <fmt/format.h>

#include "model/trust_fit.hpp"

namespace ravencal::conversion {
namespace {

Affine composed(const Affine& first, const Affine& then) {
  return {then.gain.cwiseProduct(first.gain), then.gain.cwiseProduct(first.offset) + then.offset};
}

/// The scaling of one end, from the graph or from the scaling file. Both stand together where one
/// of them is no scaling: a normalisation that was trained, or mean 0 and scale 1.
core::Result<Affine> scaling_of_end(const Affine& of_graph,
                                    const std::optional<FileScaling>& of_file, bool is_input) {
  const char* what = is_input ? "input" : "output";
  const bool is_plain =
      of_file && (of_file->mean.array() == 0.0).all() && (of_file->scale.array() == 1.0).all();
  if (of_graph.gain.size() > 0 && of_file && !is_plain && !of_graph.is_learned) {
    return core::data_error(
        fmt::format("the {0}s are scaled twice, in the network and by {0}_mean and {0}_scale "
                    "of the scaling file; take these out of the file",
                    what));
  }
  if (!of_file && of_graph.gain.size() > 0 && !of_graph.is_learned) return of_graph;
  if (!of_file) {
    return core::data_error(
        fmt::format("nothing scales the {0}s: give {0}_mean and {0}_scale in the scaling file "
                    "(0 and 1 for a network that was trained on plain values)",
                    what));
  }
  if (is_input) {
    const Affine scaled{of_file->scale.cwiseInverse(),
                        -of_file->mean.cwiseQuotient(of_file->scale)};
    return of_graph.gain.size() > 0 ? composed(scaled, of_graph) : scaled;
  }
  const Affine unscaled{of_file->scale, of_file->mean};
  return of_graph.gain.size() > 0 ? composed(of_graph, unscaled) : unscaled;
}

/// scaled = gain * x + offset as (x_si - mean) / scale with scale > 0; a sign goes into the
/// weights, and an input without gain into the biases.
void set_input(const Affine& affine, const Eigen::VectorXd& to_si, model::CalibrationModel& model) {
  const Eigen::Index n = affine.gain.size();
  model.input = {Eigen::VectorXd::Zero(n), to_si};
  model::DenseLayer& first = model.layers.front();
  for (Eigen::Index i = 0; i < n; ++i) {
    const double gain = affine.gain[i];
    if (gain == 0.0) {
      first.biases += first.weights.col(i) * static_cast<float>(affine.offset[i]);
      first.weights.col(i).setZero();
      continue;
    }
    model.input.mean[i] = -affine.offset[i] / gain * to_si[i];
    model.input.scale[i] = to_si[i] / std::abs(gain);
    if (gain < 0.0) first.weights.col(i) *= -1.0F;
  }
}

core::Status set_output(const Affine& affine, const Eigen::VectorXd& to_si,
                        model::CalibrationModel& model) {
  model.output = {affine.offset.cwiseProduct(to_si), affine.gain.cwiseAbs().cwiseProduct(to_si)};
  model::DenseLayer& last = model.layers.back();
  for (Eigen::Index k = 0; k < affine.gain.size(); ++k) {
    if (affine.gain[k] > 0.0) continue;
    if (affine.gain[k] == 0.0 || last.activation != model::Activation::kLinear) {
      return core::data_error(
          fmt::format("output {} is scaled by {} behind its last layer, which the weights "
                      "cannot hold",
                      k, affine.gain[k]));
    }
    last.weights.row(k) *= -1.0F;
    last.biases[k] *= -1.0F;
  }
  return {};
}

core::Status set_range(const ScalingFile& scaling, const model::FeatureMatrix& rows,
                       model::CalibrationModel& model) {
  if (scaling.input_min.size() > 0) {
    model.input_min = scaling.input_min.cwiseProduct(scaling.feature_to_si);
    model.input_max = scaling.input_max.cwiseProduct(scaling.feature_to_si);
  } else if (rows.rows() > 0) {
    model.input_min = rows.cast<double>().colwise().minCoeff().transpose();
    model.input_max = rows.cast<double>().colwise().maxCoeff().transpose();
  } else {
    return core::data_error(
        "the range of the training inputs is not known, beyond which the plugin trusts no "
        "correction: give the recordings of the training with --calibrate, or input_min and "
        "input_max in the scaling file");
  }
  if (rows.rows() > 0) model.trust = model::fit_trust_region(model.input, rows);
  return {};
}

core::Status set_window(const ForeignNetwork& network, const ScalingFile& scaling,
                        model::CalibrationModel& model) {
  if (!network.has_gru) {
    return scaling.window == 0
               ? core::Status()
               : core::data_error("the scaling file gives a window, but the network has no GRU");
  }
  if (network.window != 0 && scaling.window != 0 && network.window != scaling.window) {
    return core::data_error(fmt::format("the network looks at {} samples, the scaling file says {}",
                                        network.window, scaling.window));
  }
  const std::uint32_t window = network.window != 0 ? network.window : scaling.window;
  if (window < 2 || window > model::packed::kMaxWindow || scaling.stride_rows < 1) {
    return core::data_error(
        fmt::format("the GRU looks at {} samples, {} rows apart; 2 to {} samples at least a row "
                    "apart are possible ('window' and 'stride_rows' in the scaling file)",
                    window, scaling.stride_rows, model::packed::kMaxWindow));
  }
  model.layers[1].window = static_cast<std::uint8_t>(window);
  model.layers[1].stride_rows = scaling.stride_rows;
  return {};
}

}  // namespace

core::Result<model::CalibrationModel> assemble(const ForeignModel& source,
                                               const ScalingFile& scaling,
                                               const model::FeatureMatrix& training_rows) {
  const ForeignNetwork& network = source.network;
  const auto features = static_cast<Eigen::Index>(scaling.features.size());
  const auto outputs = static_cast<Eigen::Index>(scaling.outputs.size());
  if (network.inputs != features || network.outputs != outputs) {
    return core::data_error(
        fmt::format("the network has {} inputs and {} outputs, the scaling file names {} and {}",
                    network.inputs, network.outputs, features, outputs));
  }
  RAVENCAL_ASSIGN_OR_RETURN(const Affine input, scaling_of_end(network.input, scaling.input, true));
  RAVENCAL_ASSIGN_OR_RETURN(const Affine output,
                            scaling_of_end(network.output, scaling.output, false));
  model::CalibrationModel model;
  model.features = scaling.features;
  model.outputs = scaling.outputs;
  model.layers = network.layers;
  model.row_period_s = scaling.row_period_s;
  model.origin.arm = scaling.arm;
  set_input(input, scaling.feature_to_si, model);
  RAVENCAL_RETURN_IF_ERROR(set_output(output, scaling.output_to_si, model));
  RAVENCAL_RETURN_IF_ERROR(set_window(network, scaling, model));
  RAVENCAL_RETURN_IF_ERROR(set_range(scaling, training_rows, model));
  model.provenance["converted_from"] = source.origin;
  return model;
}

}  // namespace ravencal::conversion
