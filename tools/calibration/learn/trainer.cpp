// SPDX-License-Identifier: Apache-2.0
#include "learn/trainer.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <thread>

#include "core/random.hpp"
#include "learn/aligned.hpp"
#include "learn/thread_pool.hpp"

namespace ravencal::learn {
namespace {

/// Parameters that one thread updates at a time: 64 KiB of float, half a second-level cache with
/// its moments and gradients.
constexpr std::ptrdiff_t kUpdateChunk = 16384;

/// Salt of the shuffle's random numbers, so that they do not repeat those of the initial weights.
constexpr std::uint64_t kShuffleSalt = 0x9e3779b97f4a7c15ULL;
constexpr std::uint64_t kNoiseSalt = 0xd1b54a32d192ed03ULL;

template <typename Scalar>
const Kernels<Scalar>& kernels_for(Isa isa) {
  if constexpr (std::is_same_v<Scalar, float>) {
    return float_kernels(isa);
  } else {
    return double_kernels();
  }
}

std::ptrdiff_t ceil_div(std::ptrdiff_t a, std::ptrdiff_t b) { return (a + b - 1) / b; }

}  // namespace

unsigned default_threads(const Shape& shape, const TrainerSettings& settings) {
  constexpr double kSmallStepFlops = 1e7;  // about 0.1 ms of one core, some barriers' worth
  if (shape.training_flops_per_sample() * settings.batch < kSmallStepFlops) return 1;
  const auto tiles = static_cast<unsigned>(ceil_div(settings.batch, settings.tile));
  return std::clamp(std::thread::hardware_concurrency(), 1U, tiles);
}

template <typename Scalar>
struct Trainer<Scalar>::Impl {
  Impl(Shape network, const TrainerSettings& train_settings, std::span<const double> start)
      : shape(std::move(network)),
        settings(train_settings),
        kernels(kernels_for<Scalar>(train_settings.isa)),
        pool(train_settings.threads > 0 ? train_settings.threads
                                        : default_threads(shape, train_settings)),
        random(train_settings.seed ^ kShuffleSalt) {
    const auto size = static_cast<std::size_t>(shape.parameter_count());
    parameters.assign(start.begin(), start.end());
    first_moment.assign(size, Scalar(0));
    second_moment.assign(size, Scalar(0));
    inputs.resize(pool.size());
    targets.resize(pool.size());
    workspaces.resize(pool.size());
    for (unsigned worker = 0; worker < pool.size(); ++worker) {
      inputs[worker].resize(static_cast<std::size_t>(shape.inputs()) * settings.tile);
      targets[worker].resize(static_cast<std::size_t>(shape.outputs()) * settings.tile);
      workspaces[worker].resize(static_cast<std::size_t>(shape.workspace_size(settings.tile)));
    }
    make_ranges();
  }

  void make_ranges() {
    const auto append = [&](std::ptrdiff_t first, std::ptrdiff_t count, double l1, double l2) {
      for (std::ptrdiff_t begin = first; begin < first + count; begin += kUpdateChunk) {
        UpdateRange<Scalar> range;
        range.begin = begin;
        range.end = std::min(begin + kUpdateChunk, first + count);
        range.l1 = static_cast<Scalar>(l1);
        range.l2 = static_cast<Scalar>(l2);
        ranges.push_back(range);
      }
    };
    const Penalties& p = settings.penalties;
    for (std::size_t k = 0; k < shape.layers().size(); ++k) {
      const LayerShape& layer = shape.layers()[k];
      const bool hidden = k + 1 < shape.layers().size();
      append(layer.weights, layer.inputs * layer.outputs, hidden ? p.l1_weights : 0.0,
             hidden ? p.l2_weights : 0.0);
      append(layer.biases, layer.outputs, 0.0, hidden ? p.l2_biases : 0.0);
    }
  }

  /// Copies `count` samples, `rows` of them in order or the `first`... if rows is null, into the
  /// worker's buffers.
  Tile<Scalar> gather(const Samples<Scalar>& samples, const std::uint32_t* rows,
                      std::ptrdiff_t first, std::ptrdiff_t count, unsigned worker) {
    const std::ptrdiff_t in = shape.inputs();
    const std::ptrdiff_t out = shape.outputs();
    for (std::ptrdiff_t i = 0; i < count; ++i) {
      const std::ptrdiff_t row = rows != nullptr ? rows[first + i] : first + i;
      std::memcpy(inputs[worker].data() + i * in, samples.inputs.data() + row * in,
                  static_cast<std::size_t>(in) * sizeof(Scalar));
      std::memcpy(targets[worker].data() + i * out, samples.targets.data() + row * out,
                  static_cast<std::size_t>(out) * sizeof(Scalar));
    }
    Tile<Scalar> tile;
    tile.layers = shape.layers().data();
    tile.layer_count = static_cast<std::ptrdiff_t>(shape.layers().size());
    tile.parameters = parameters.data();
    tile.inputs = inputs[worker].data();
    tile.targets = targets[worker].data();
    tile.samples = count;
    tile.workspace = workspaces[worker].data();
    return tile;
  }

  /// Noise of settings.input_noise on the `count` samples of a worker's buffer; `first` is where
  /// they lie in the batch. Uniform, for the penalty depends on the variance alone.
  void add_noise(std::ptrdiff_t first, std::ptrdiff_t count, unsigned worker) {
    const float width = 2.0F * std::sqrt(3.0F);  // of a uniform distribution of variance 1
    const auto in = static_cast<std::uint64_t>(shape.inputs());
    const std::uint64_t step = (settings.seed ^ kNoiseSalt) + (steps << 40U);
    for (std::uint64_t i = 0; i < static_cast<std::uint64_t>(count); ++i) {
      for (std::uint64_t k = 0; k < in; ++k) {
        if (settings.input_noise[k] == 0.0F) continue;
        const std::uint64_t key = step + (static_cast<std::uint64_t>(first) + i) * in + k;
        const float noise = width * settings.input_noise[k] * (core::hashed_unit(key) - 0.5F);
        inputs[worker][i * in + k] += static_cast<Scalar>(noise);
      }
    }
  }

  /// Tile gradients of the batch samples[rows[begin, end)], with noise (or samples[begin, end),
  /// without, if rows is null).
  TileLoss tile_gradients(const Samples<Scalar>& samples, const std::uint32_t* rows,
                          std::ptrdiff_t begin, std::ptrdiff_t end) {
    const std::ptrdiff_t count = end - begin;
    const auto tiles = static_cast<std::size_t>(ceil_div(count, settings.tile));
    while (gradients.size() < tiles) {
      gradients.emplace_back(static_cast<std::size_t>(shape.parameter_count()), Scalar(0));
      gradient_pointers.push_back(gradients.back().data());
    }
    losses.assign(tiles, {});
    const double outputs = static_cast<double>(count * shape.outputs());
    const double activity = settings.penalties.l2_activity / static_cast<double>(count);
    pool.run(tiles, [&](std::size_t index, unsigned worker) {
      const std::ptrdiff_t first = begin + static_cast<std::ptrdiff_t>(index) * settings.tile;
      Tile<Scalar> tile = gather(samples, rows, first,
                                 std::min<std::ptrdiff_t>(settings.tile, end - first), worker);
      if (rows != nullptr && !settings.input_noise.empty()) {
        add_noise(first - begin, tile.samples, worker);
      }
      tile.error_weight = static_cast<Scalar>(1.0 / outputs);
      tile.activity_weight = static_cast<Scalar>(activity);
      losses[index] = kernels.gradient(tile, gradients[index].data());
    });
    for (UpdateRange<Scalar>& range : ranges) {
      range.tile_gradients = gradient_pointers.data();
      range.tile_count = static_cast<std::ptrdiff_t>(tiles);
    }
    TileLoss total;
    for (const TileLoss& loss : losses) {
      total.squared_error += loss.squared_error;
      total.squared_activity += loss.squared_activity;
    }
    return total;
  }

  void adam_step() {
    ++steps;
    const AdamSettings& a = settings.adam;
    AdamStep<Scalar> step;
    step.step_size = static_cast<Scalar>(
        a.learning_rate * std::sqrt(1.0 - std::pow(a.beta2, static_cast<double>(steps))) /
        (1.0 - std::pow(a.beta1, static_cast<double>(steps))));
    step.beta1 = static_cast<Scalar>(a.beta1);
    step.beta2 = static_cast<Scalar>(a.beta2);
    step.epsilon = static_cast<Scalar>(a.epsilon);
    pool.run(ranges.size(), [&](std::size_t index, unsigned /*worker*/) {
      kernels.adam(ranges[index], step, parameters.data(), first_moment.data(),
                   second_moment.data());
    });
  }

  Shape shape;
  TrainerSettings settings;
  const Kernels<Scalar>& kernels;
  ThreadPool pool;
  core::Random random;
  AlignedVector<Scalar> parameters;
  AlignedVector<Scalar> first_moment;
  AlignedVector<Scalar> second_moment;
  std::vector<AlignedVector<Scalar>> gradients;  ///< one per tile of a batch
  std::vector<const Scalar*> gradient_pointers;
  std::vector<AlignedVector<Scalar>> inputs;  ///< one per thread, as the next two
  std::vector<AlignedVector<Scalar>> targets;
  std::vector<AlignedVector<Scalar>> workspaces;
  std::vector<TileLoss> losses;
  std::vector<UpdateRange<Scalar>> ranges;
  std::vector<std::uint32_t> order;
  std::uint64_t steps = 0;
};

template <typename Scalar>
Trainer<Scalar>::Trainer(Shape shape, const TrainerSettings& settings,
                         std::span<const double> parameters)
    : impl_(std::make_unique<Impl>(std::move(shape), settings, parameters)) {}

template <typename Scalar>
Trainer<Scalar>::~Trainer() = default;

template <typename Scalar>
Loss Trainer<Scalar>::loss_and_gradient(const Samples<Scalar>& samples,
                                        std::span<Scalar> gradient) {
  const std::ptrdiff_t count = samples.count();
  const TileLoss sums = impl_->tile_gradients(samples, nullptr, 0, count);
  std::fill(gradient.begin(), gradient.end(), Scalar(0));
  for (const UpdateRange<Scalar>& range : impl_->ranges) {
    impl_->kernels.total_gradient(range, impl_->parameters.data(), gradient.data());
  }
  Loss loss;
  loss.mean_squared_error =
      sums.squared_error / static_cast<double>(count * impl_->shape.outputs());
  loss.penalty = weight_penalty() + impl_->settings.penalties.l2_activity * sums.squared_activity /
                                        static_cast<double>(count);
  return loss;
}

template <typename Scalar>
double Trainer<Scalar>::run_epoch(const Samples<Scalar>& samples) {
  const std::ptrdiff_t count = samples.count();
  auto& order = impl_->order;
  if (order.size() != static_cast<std::size_t>(count)) {
    order.resize(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 0U);
  }
  impl_->random.shuffle(std::span(order));
  double squared_error = 0.0;
  for (std::ptrdiff_t begin = 0; begin < count; begin += impl_->settings.batch) {
    const std::ptrdiff_t end = std::min<std::ptrdiff_t>(begin + impl_->settings.batch, count);
    squared_error += impl_->tile_gradients(samples, order.data(), begin, end).squared_error;
    impl_->adam_step();
  }
  return squared_error / static_cast<double>(count * impl_->shape.outputs());
}

template <typename Scalar>
double Trainer<Scalar>::mean_squared_error(const Samples<Scalar>& samples) {
  const std::ptrdiff_t count = samples.count();
  const std::ptrdiff_t tile_size = impl_->settings.tile;
  std::vector<double> sums(static_cast<std::size_t>(ceil_div(count, tile_size)), 0.0);
  const auto width = static_cast<std::size_t>(impl_->shape.outputs() * tile_size);
  std::vector<AlignedVector<Scalar>> outputs(impl_->pool.size(), AlignedVector<Scalar>(width));
  impl_->pool.run(sums.size(), [&](std::size_t index, unsigned worker) {
    const std::ptrdiff_t first = static_cast<std::ptrdiff_t>(index) * tile_size;
    const Tile<Scalar> tile =
        impl_->gather(samples, nullptr, first, std::min(tile_size, count - first), worker);
    impl_->kernels.forward(tile, outputs[worker].data());
    for (std::ptrdiff_t i = 0; i < tile.samples * impl_->shape.outputs(); ++i) {
      const auto error =
          static_cast<double>(outputs[worker][static_cast<std::size_t>(i)] - tile.targets[i]);
      sums[index] += error * error;
    }
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0) /
         static_cast<double>(count * impl_->shape.outputs());
}

template <typename Scalar>
double Trainer<Scalar>::weight_penalty() const {
  double penalty = 0.0;
  for (const UpdateRange<Scalar>& range : impl_->ranges) {
    const std::span values(impl_->parameters.data() + range.begin,
                           static_cast<std::size_t>(range.end - range.begin));
    for (const Scalar value : values) {
      const auto v = static_cast<double>(value);
      penalty +=
          static_cast<double>(range.l1) * std::abs(v) + static_cast<double>(range.l2) * v * v;
    }
  }
  return penalty;
}

template <typename Scalar>
std::span<const Scalar> Trainer<Scalar>::parameters() const {
  return impl_->parameters;
}

template class Trainer<float>;
template class Trainer<double>;

FitResult fit(const Shape& shape, const TrainerSettings& settings, const Samples<float>& training,
              const Samples<float>* validation,
              const std::function<bool(const EpochReport&)>& keep_going) {
  Trainer<float> trainer(shape, settings, initial_parameters(shape, settings.seed));
  FitResult result;
  double best = std::numeric_limits<double>::infinity();
  for (std::uint32_t epoch = 1; epoch <= settings.epochs; ++epoch) {
    EpochReport report;
    report.epoch = epoch;
    report.training = trainer.run_epoch(training);
    report.penalty = trainer.weight_penalty();
    report.validation = validation != nullptr ? trainer.mean_squared_error(*validation)
                                              : std::numeric_limits<double>::quiet_NaN();
    report.best = validation == nullptr || report.validation < best;
    if (report.best) {
      best = report.validation;
      const std::span<const float> current = trainer.parameters();
      result.parameters.assign(current.begin(), current.end());
      result.kept_epoch = epoch;
    }
    result.epochs.push_back(report);
    if (!keep_going(report)) {
      result.interrupted = epoch < settings.epochs;
      break;
    }
  }
  return result;
}

}  // namespace ravencal::learn
