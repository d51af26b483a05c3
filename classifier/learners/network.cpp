#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "classifier/base/random.hpp"
#include "classifier/fabric/model_text.hpp"
#include "classifier/learners/learners.hpp"

namespace weft::classifier {
namespace {

constexpr std::size_t most_batch = 200, most_passes = 1000, patience = 10;
constexpr float penalty = 1e-4F;
constexpr double tolerance = 1e-4;
constexpr std::size_t most_layers = 3, most_units = 10'000;

// Weights of one layer.
struct Layer {
  std::size_t in, out, columns;  // columns: of `out`, padded
  AlignedFloats weight, bias;    // [in x columns], [columns]

  Layer(std::size_t from, std::size_t to)
      : in(from), out(to), columns(padded_columns(to)), weight(in * columns), bias(columns) {}

  // values [rows x columns] = input [rows x padded in] weight + bias
  void forward(const float* input, std::size_t rows, float* values) const {
    product(input, rows, in, padded_columns(in), weight.data(), columns, values);
    for (std::size_t r = 0; r < rows; ++r)
      for (std::size_t c = 0; c < columns; ++c) values[r * columns + c] += bias[c];
  }
};

void rectify(AlignedFloats& values) {
  for (float& v : values) v = v > 0.0F ? v : 0.0F;
}

// Initial weights of Glorot and Bengio 2010, as in scikit-learn for ReLU.
Layer random_layer(std::size_t in, std::size_t out, RandomEngine& engine) {
  Layer layer(in, out);
  const double bound = std::sqrt(6.0 / static_cast<double>(in + out));
  const auto draw = [&] { return static_cast<float>(bound * (2.0 * random_unit(engine) - 1.0)); };
  for (std::size_t i = 0; i < in; ++i)
    for (std::size_t o = 0; o < out; ++o) layer.weight[i * layer.columns + o] = draw();
  for (std::size_t o = 0; o < out; ++o) layer.bias[o] = draw();
  return layer;
}

// Moments of Adam (Kingma and Ba 2015) for one array.
struct Moments {
  AlignedFloats first, second;
  explicit Moments(std::size_t size) : first(size, 0.0F), second(size, 0.0F) {}
};

WEFT_CLONES("arch=x86-64-v4", "avx2")
void adam_step(float* value, const float* slope, float* first, float* second, std::size_t size,
               float rate) {
  constexpr float use_first = 0.9F, use_second = 0.999F, least = 1e-8F;
  for (std::size_t i = 0; i < size; ++i) {
    first[i] = use_first * first[i] + (1.0F - use_first) * slope[i];
    second[i] = use_second * second[i] + (1.0F - use_second) * slope[i] * slope[i];
    value[i] -= rate * first[i] / (std::sqrt(second[i]) + least);
  }
}

// Transposes [rows x columns] with row stride `stride` to [columns x rows_stride].
void transpose(const float* from, std::size_t rows, std::size_t columns, std::size_t stride,
               AlignedFloats& to, std::size_t rows_stride) {
  to.assign(columns * rows_stride, 0.0F);
  for (std::size_t r = 0; r < rows; ++r)
    for (std::size_t c = 0; c < columns; ++c) to[c * rows_stride + r] = from[r * stride + c];
}

class Network final : public Predictor {
 public:
  explicit Network(std::vector<Layer> layers) : layers_(std::move(layers)) {}
  [[nodiscard]] Result<ClassScores> predict(std::span<const double> features) const override {
    AlignedFloats values(padded_columns(features.size()), 0.0F), next;
    std::transform(features.begin(), features.end(), values.begin(),
                   [](double v) { return static_cast<float>(v); });
    for (std::size_t l = 0; l < layers_.size(); ++l) {
      next.assign(layers_[l].columns, 0.0F);
      layers_[l].forward(values.data(), 1, next.data());
      if (l + 1 < layers_.size()) rectify(next);
      std::swap(values, next);
    }
    const auto end = values.begin() + static_cast<std::ptrdiff_t>(layers_.back().out);
    return scores_of({values.begin(), end}, "network");
  }

  // One line per input; single precision is exact in doubles.
  void write(LineWriter& out) const override {
    out.count("layers", layers_.size());
    for (const Layer& layer : layers_) {
      out.count("units", layer.out);
      for (std::size_t i = 0; i < layer.in; ++i)
        out.numbers("weight", doubles(layer.weight.data() + i * layer.columns, layer.out));
      out.numbers("bias", doubles(layer.bias.data(), layer.out));
    }
  }

 private:
  static std::vector<double> doubles(const float* values, std::size_t count) {
    return {values, values + count};
  }

  std::vector<Layer> layers_;
};

Layer read_layer(LineReader& in, std::size_t inputs) {
  const std::size_t units = in.count("units", 1, most_units);
  const Matrix weight = read_rows(in, "weight", inputs, units);
  const std::vector<double> bias = in.numbers("bias", units);
  if (!in.ok()) return {0, 0};
  Layer out(inputs, units);
  for (std::size_t i = 0; i < inputs; ++i)
    for (std::size_t o = 0; o < units; ++o)
      out.weight[i * out.columns + o] = static_cast<float>(weight(i, o));
  std::transform(bias.begin(), bias.end(), out.bias.begin(),
                 [](double v) { return static_cast<float>(v); });
  return out;
}

class Trainer {
 public:
  Trainer(const TrainingSet& training, const std::vector<std::size_t>& hidden, std::uint64_t seed)
      : training_(training), engine_(seed), order_(numbers_below(training.rows().rows())) {
    std::size_t from = training.rows().cols();
    for (const std::size_t to : hidden) add_layer(from, to);
    add_layer(from, training.classes());
    values_.resize(layers_.size() + 1);
  }

  Result<std::vector<Layer>> train(const std::function<bool()>& stop) {
    double best = std::numeric_limits<double>::infinity();
    std::size_t idle = 0;
    for (std::size_t round = 0; round < most_passes && idle <= patience; ++round) {
      if (auto ok = unless_stopped(stop); !ok) return pass(ok.error());
      const double loss = one_pass();
      idle = loss > best - tolerance ? idle + 1 : 0;
      best = std::min(best, loss);
    }
    return std::move(layers_);
  }

 private:
  void add_layer(std::size_t& from, std::size_t to) {
    layers_.push_back(random_layer(from, to, engine_));
    const Layer& own = layers_.back();
    weight_moments_.emplace_back(own.weight.size());
    bias_moments_.emplace_back(own.columns);
    from = to;
  }

  double one_pass() {
    shuffle(order_, engine_);
    const std::size_t batch = std::min(most_batch, order_.size());
    double loss = 0.0;
    for (std::size_t from = 0; from < order_.size(); from += batch)
      loss += one_batch(std::span(order_).subspan(from, std::min(batch, order_.size() - from)));
    return loss / static_cast<double>(order_.size());
  }

  // Returns the sum of the losses of the rows before the step.
  double one_batch(std::span<const std::size_t> rows) {
    load(rows);
    for (std::size_t l = 0; l < layers_.size(); ++l) {
      values_[l + 1].resize(rows.size() * layers_[l].columns);
      layers_[l].forward(values_[l].data(), rows.size(), values_[l + 1].data());
      if (l + 1 < layers_.size()) rectify(values_[l + 1]);
    }
    double loss = cross_entropy(rows);
    for (const Layer& layer : layers_)
      for (const float w : layer.weight) loss += 0.5 * penalty * w * w;
    ++steps_;
    const double t = static_cast<double>(steps_);
    const double rate = 1e-3 * std::sqrt(1.0 - std::pow(0.999, t)) / (1.0 - std::pow(0.9, t));
    for (std::size_t l = layers_.size(); l-- > 0;)
      step_layer(l, rows.size(), static_cast<float>(rate));
    return loss;
  }

  void load(std::span<const std::size_t> rows) {
    const Matrix& all = training_.rows();
    const std::size_t columns = padded_columns(all.cols());
    values_[0].assign(rows.size() * columns, 0.0F);
    for (std::size_t r = 0; r < rows.size(); ++r)
      for (std::size_t f = 0; f < all.cols(); ++f)
        values_[0][r * columns + f] = static_cast<float>(all(rows[r], f));
  }

  // Replaces the scores by the probabilities minus the truth.
  double cross_entropy(std::span<const std::size_t> rows) {
    const std::size_t columns = layers_.back().columns, classes = layers_.back().out;
    slope_ = values_.back();
    double loss = 0.0;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      float* const score = slope_.data() + r * columns;
      const std::size_t truth = training_.of_row()[rows[r]];
      const float most = *std::max_element(score, score + classes), own = score[truth];
      float whole = 0.0F;
      for (std::size_t c = 0; c < classes; ++c) whole += score[c] = std::exp(score[c] - most);
      for (std::size_t c = 0; c < classes; ++c) score[c] /= whole;
      std::fill(score + classes, score + columns, 0.0F);
      score[truth] -= 1.0F;
      loss += std::log(static_cast<double>(whole)) + most - own;
    }
    return loss;
  }

  // On entry slope_ has the slopes of the layer's outputs, on return those of its inputs.
  void step_layer(std::size_t l, std::size_t rows, float rate) {
    Layer& layer = layers_[l];
    const std::size_t in_columns = padded_columns(layer.in);
    transpose(values_[l].data(), rows, layer.in, in_columns, turned_, rows);
    weight_slope_.resize(layer.weight.size());
    product(turned_.data(), layer.in, rows, rows, slope_.data(), layer.columns,
            weight_slope_.data());
    bias_slope_.assign(layer.columns, 0.0F);
    for (std::size_t r = 0; r < rows; ++r)
      for (std::size_t c = 0; c < layer.columns; ++c)
        bias_slope_[c] += slope_[r * layer.columns + c];
    if (l > 0) {
      transpose(layer.weight.data(), layer.in, layer.out, layer.columns, turned_, in_columns);
      next_slope_.resize(rows * in_columns);
      product(slope_.data(), rows, layer.out, layer.columns, turned_.data(), in_columns,
              next_slope_.data());
      for (std::size_t i = 0; i < next_slope_.size(); ++i)
        next_slope_[i] = values_[l][i] > 0.0F ? next_slope_[i] : 0.0F;
      std::swap(slope_, next_slope_);
    }
    const float share = 1.0F / static_cast<float>(rows);
    for (std::size_t i = 0; i < weight_slope_.size(); ++i)
      weight_slope_[i] = (weight_slope_[i] + penalty * layer.weight[i]) * share;
    for (float& v : bias_slope_) v *= share;
    Moments &w = weight_moments_[l], &b = bias_moments_[l];
    adam_step(layer.weight.data(), weight_slope_.data(), w.first.data(), w.second.data(),
              layer.weight.size(), rate);
    adam_step(layer.bias.data(), bias_slope_.data(), b.first.data(), b.second.data(),
              layer.bias.size(), rate);
  }

  const TrainingSet& training_;
  RandomEngine engine_;
  std::vector<std::size_t> order_;
  std::vector<Layer> layers_;
  std::vector<Moments> weight_moments_, bias_moments_;
  std::vector<AlignedFloats> values_;  // values of the inputs, then of every layer
  AlignedFloats slope_, next_slope_, weight_slope_, bias_slope_, turned_;
  std::size_t steps_ = 0;
};

using Floats = float __attribute__((vector_size(column_step * sizeof(float))));
constexpr std::size_t rows_at_once = 6, vectors_at_once = 2;  // sums stay in registers

struct __attribute__((packed, may_alias)) Loose {
  Floats value;
};
WEFT_INLINE Floats load(const float* p) {
  return reinterpret_cast<const Loose*>(p)->value;
}

template <std::size_t R, std::size_t V>
WEFT_INLINE void tile(const float* a, std::size_t inner, std::size_t a_stride, const float* b,
                      std::size_t columns, float* out) {
  Floats sum[R][V] = {};
  for (std::size_t i = 0; i < inner; ++i, b += columns) {
    Floats row[V];
    for (std::size_t v = 0; v < V; ++v) row[v] = load(b + v * column_step);
    for (std::size_t r = 0; r < R; ++r) {
      const float factor = a[r * a_stride + i];
      for (std::size_t v = 0; v < V; ++v) sum[r][v] += row[v] * factor;
    }
  }
  for (std::size_t r = 0; r < R; ++r)
    for (std::size_t v = 0; v < V; ++v)
      reinterpret_cast<Loose*>(out + r * columns + v * column_step)->value = sum[r][v];
}

template <std::size_t R>
WEFT_INLINE void stripe(const float* a, std::size_t inner, std::size_t a_stride, const float* b,
                        std::size_t columns, float* out) {
  constexpr std::size_t wide = vectors_at_once * column_step;
  std::size_t c = 0;
  for (; c + wide <= columns; c += wide)
    tile<R, vectors_at_once>(a, inner, a_stride, b + c, columns, out + c);
  if (c < columns) tile<R, 1>(a, inner, a_stride, b + c, columns, out + c);
}

}  // namespace

Result<PredictorPtr> fit_network(const TrainingSet& training,
                                 const std::vector<std::size_t>& hidden,
                                 const TrainOptions& options) {
  auto layers = Trainer(training, hidden, options.seed).train(options.stop);
  if (!layers) return pass(layers.error());
  for (const Layer& layer : *layers)
    for (const float w : layer.weight)
      if (!std::isfinite(w))
        return fail({.code = Errc::range,
                     .where = "NN",
                     .what = "network weights not finite after training",
                     .hint = "Scale the features first"});
  return std::make_unique<Network>(std::move(*layers));
}

PredictorPtr read_network(LineReader& in, std::size_t features, std::size_t classes) {
  std::vector<Layer> layers;
  std::size_t inputs = features;
  for (std::size_t left = in.count("layers", 1, most_layers); in.ok() && left > 0; --left) {
    layers.push_back(read_layer(in, inputs));
    inputs = layers.back().out;
  }
  if (inputs != classes)
    in.refuse("number of units in the last layer differs from the labels", std::to_string(classes),
              std::to_string(inputs));
  if (!in.ok()) return nullptr;
  return std::make_unique<Network>(std::move(layers));
}

WEFT_CLONES("arch=x86-64-v4", "avx2")
void product(const float* a, std::size_t rows, std::size_t inner, std::size_t a_stride,
             const float* b, std::size_t columns, float* out) {
  std::size_t r = 0;
  for (; r + rows_at_once <= rows; r += rows_at_once)
    stripe<rows_at_once>(a + r * a_stride, inner, a_stride, b, columns, out + r * columns);
  for (; r < rows; ++r) stripe<1>(a + r * a_stride, inner, a_stride, b, columns, out + r * columns);
}

}  // namespace weft::classifier
