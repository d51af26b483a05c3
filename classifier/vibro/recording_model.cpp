#include "classifier/vibro/recording_model.hpp"

#include <algorithm>
#include <optional>
#include <set>

#include "classifier/base/content_digest.hpp"
#include "classifier/vibro/cross_validation.hpp"
#include "classifier/vibro/protocol.hpp"
#include "classifier/vibro/recording_probability.hpp"

namespace weft::classifier::vibro {
namespace {

PlacesOf places_in(const RecordingSetup& setup) {
  ProtocolOptions options;
  options.protocol = Protocol::groups;  // whole recordings
  options.window_s = setup.window_s;
  options.step_s = setup.step_s;
  return places_of(options);
}

}  // namespace

std::uint64_t content_digest(const Recording& recording) {
  ContentDigest digest;
  for (const Channel& channel : recording.channels) digest.add(std::span(&channel.rate_hz, 1));
  for (const std::vector<double>& samples : recording.samples) digest.add(samples);
  return digest.value();
}

std::vector<TooShort> too_short_for(const RecordingSetup& setup,
                                    std::span<const Recording> recordings) {
  return lay_out(recordings, setup.window_s, places_in(setup)).too_short;
}

Result<ChosenRecipe> choose_recipe(std::span<const Recording> recordings,
                                   const RecordingSetup& setup, bool features_are_named,
                                   std::size_t components, const TrainOptions& options) {
  FeatureChoice features = setup.features;
  if (!features_are_named) features.family = Family::wide;
  const auto windows = cut_and_extract(recordings, setup.window_s, places_in(setup), features);
  if (!windows) return pass(windows.error());
  const std::vector<Recipe> tried =
      features_are_named
          ? window_candidates(components)
          : window_candidates(recordings.front().channels, features.combine, components);
  const auto best = train_best(windows->matrix, tried, options);
  if (!best) return pass(best.error());
  ChosenRecipe out{best->recipe, features, best->scores};
  if (!features_are_named) {
    const auto family = family_from(best->recipe.features);
    if (!family) return pass(family.error());
    out.features.family = *family;
    out.recipe.columns.clear();
  }
  return out;
}

std::string reason_without_probability(std::span<const Recording> recordings,
                                       const RecordingSetup& setup, const Recipe& recipe,
                                       const TrainOptions& options) {
  WindowSet windows = lay_out(recordings, setup.window_s, places_in(setup));
  windows.matrix.values = Matrix(windows.places.size(), 0);
  return reason_without_probability(windows.matrix, recipe.learner, options);
}

Result<RecordingModel> train_recording_model(std::span<const Recording> recordings,
                                             const RecordingSetup& setup, const Recipe& recipe,
                                             const TrainOptions& options, Provenance provenance) {
  auto windows = cut_and_extract(recordings, setup.window_s, places_in(setup), setup.features);
  if (!windows) return pass(windows.error());
  const FeatureMatrix& matrix = windows->matrix;
  if (matrix.size() == 0)
    return fail({.code = Errc::invalid_argument,
                 .what = "all recordings shorter than a window",
                 .expected = "at least " + std::to_string(setup.window_s) + " s",
                 .hint = "Use a shorter --window-s"});
  const std::set<std::string> labels(matrix.labels.begin(), matrix.labels.end());
  for (const TooShort& one : windows->too_short)
    if (!labels.contains(one.label))
      return fail({.code = Errc::invalid_argument,
                   .where = one.label,
                   .what = "all recordings of the label shorter than a window",
                   .expected = "at least " + std::to_string(setup.window_s) + " s",
                   .hint = "Use a shorter --window-s"});
  auto learner = train_recipe(matrix, recipe, options);
  if (!learner) return pass(learner.error());
  RecordingSetup own = setup;
  own.channels = recordings.front().channels;
  auto calibrated = calibrate_recordings(*learner, *windows, options);
  if (!calibrated) return pass(calibrated.error());
  RecordingModel out{std::move(*learner), std::move(own), std::move(provenance),
                     std::move(*calibrated)};
  for (const Recording& recording : recordings) out.trained_on.push_back(content_digest(recording));
  return out;
}

Result<std::vector<RecordingAnswer>> classify_recordings(const RecordingModel& model,
                                                         std::span<const Recording> recordings) {
  const RecordingSetup& setup = model.setup;
  for (const Recording& recording : recordings)
    if (!same_sensor(recording.channels, setup.channels))
      return fail({.code = Errc::invalid_argument,
                   .where = recording.file,
                   .what = "model trained for another sensor",
                   .expected = format_channels(setup.channels),
                   .got = format_channels(recording.channels)});
  const auto windows =
      cut_and_extract(recordings, setup.window_s, places_in(setup), setup.features);
  if (!windows) return pass(windows.error());
  std::vector<RecordingAnswer> out;
  for (const Recording& recording : recordings)
    out.push_back({recording.file,
                   recording.label,
                   0,
                   std::vector<std::size_t>(model.learner.labels().size(), 0),
                   {}});
  for (std::size_t r = 0; r < windows->matrix.size(); ++r) {
    const auto label = model.learner.classify(windows->matrix.values.row(r));
    if (!label) return pass(label.error(), windows->matrix.files[r]);
    ++out[windows->recording[r]].windows[*label];
  }
  for (RecordingAnswer& answer : out) {
    answer.label = place_of_largest(answer.windows);
    if (answer.windows[answer.label] == 0)
      return fail({.code = Errc::invalid_argument,
                   .where = answer.file,
                   .what = "recording shorter than a window",
                   .expected = "at least " + std::to_string(setup.window_s) + " s"});
    if (model.postprocessing)
      answer.probability =
          share_of_windows(answer.windows, model.postprocessing->calibration.sharpness);
  }
  return out;
}

}  // namespace weft::classifier::vibro

namespace weft::classifier {

using vibro::RecordingSetup;

namespace {
constexpr std::size_t most_channels = 1000;
}  // namespace

void SetupText<RecordingSetup>::write(LineWriter& out, const RecordingSetup& setup) {
  out.count("channels", setup.channels.size());
  for (const vibro::Channel& channel : setup.channels) {
    out.text("channel", channel.name);
    out.number("rate_hz", channel.rate_hz);
    out.text("unit", channel.unit);
  }
  out.text("family", to_string(setup.features.family));
  out.text("combine", to_string(setup.features.combine));
  out.number("window_s", setup.window_s);
  out.number("step_s", setup.step_s);
}

RecordingSetup SetupText<RecordingSetup>::read(LineReader& in) {
  RecordingSetup out;
  for (std::size_t left = in.count("channels", 1, most_channels); in.ok() && left > 0; --left) {
    vibro::Channel channel;
    channel.name = in.text("channel");
    channel.rate_hz = in.positive("rate_hz");
    channel.unit = in.text("unit");
    out.channels.push_back(std::move(channel));
  }
  out.features.family = read_name(in, "family", vibro::family_from, vibro::Family::smmrpfft);
  out.features.combine = read_name(in, "combine", vibro::combine_from, vibro::Combine::mean);
  out.window_s = in.positive("window_s");
  out.step_s = in.positive("step_s");
  return out;
}

Result<std::vector<std::string>> SetupText<RecordingSetup>::feature_names(
    const RecordingSetup& setup, std::size_t /*most*/) {
  std::vector<std::string> out;
  for (const vibro::Column& column : vibro::columns_of(setup.channels, setup.features))
    out.push_back(column.name);
  return out;
}

// Labels, name of a learner, scaling, axes of components (none: the scaled features), and the
// learner's own lines.
std::optional<ModelParts> SetupText<RecordingSetup>::read_pipeline(
    LineReader& in, const std::vector<std::string>& names) {
  std::vector<std::string> labels = read_labels(in);
  std::vector<std::string> features = names;
  const Learner learner = read_name(in, "method", learner_from, Learner::lda);
  Scaler scaler = read_scaler(in, features.size());
  Matrix axes = read_matrix(in, "axes", features.size());
  const double explained = in.not_negative("explained");
  if (!in.ok()) return std::nullopt;
  FeatureView view(axes.rows() == 0 ? FeatureView::Table(Standardised{std::move(scaler)})
                                    : FeatureView::Table(PrincipalComponents{
                                          std::move(scaler), std::move(axes), explained}));
  std::shared_ptr<const Predictor> predictor;
  if (learner == Learner::lda || learner == Learner::all) {
    const LearnerHead head = read_head(in);
    auto own = read_learner(in, head, labels, view.apply(features));
    if (own) predictor = own->share_predictor();
  } else {
    predictor = read_predictor(learner, in, view.width(features.size()), labels.size());
  }
  if (!in.ok() || predictor == nullptr) return std::nullopt;
  return ModelParts{TrainedLearner(learner, std::move(labels), std::move(features), std::move(view),
                                   std::move(predictor)),
                    std::nullopt};
}

}  // namespace weft::classifier
