#include "classifier/vibro/recording_model.hpp"

#include <algorithm>

#include "classifier/base/line_io.hpp"
#include "classifier/fabric/folds.hpp"
#include "classifier/fabric/model_text.hpp"
#include "classifier/vibro/protocol.hpp"

namespace weft::classifier::vibro {
namespace {

constexpr std::size_t most_channels = 1000;

PlacesOf places_in(const RecordingSetup& setup) {
  ProtocolOptions options;
  options.protocol = Protocol::groups;  // whole recordings
  options.window_s = setup.window_s;
  options.step_s = setup.step_s;
  return places_of(options);
}

void write_setup(LineWriter& out, const RecordingSetup& setup) {
  out.count("channels", setup.channels.size());
  for (const Channel& channel : setup.channels) {
    out.text("channel", channel.name);
    out.number("rate_hz", channel.rate_hz);
    out.text("unit", channel.unit);
  }
  out.text("family", to_string(setup.features.family));
  out.text("combine", to_string(setup.features.combine));
  out.number("window_s", setup.window_s);
  out.number("step_s", setup.step_s);
}

RecordingSetup read_setup(LineReader& in) {
  RecordingSetup out;
  for (std::size_t left = in.count("channels", 1, most_channels); in.ok() && left > 0; --left) {
    Channel channel;
    channel.name = in.text("channel");
    channel.rate_hz = in.positive("rate_hz");
    channel.unit = in.text("unit");
    out.channels.push_back(std::move(channel));
  }
  out.features.family = read_name(in, "family", family_from, Family::smmrpfft);
  out.features.combine = read_name(in, "combine", combine_from, Combine::mean);
  out.window_s = in.positive("window_s");
  out.step_s = in.positive("step_s");
  return out;
}

Result<RecordingModel> read_body(std::string_view body) {
  LineReader in(body);
  Provenance provenance = read_provenance(in);
  RecordingSetup setup = read_setup(in);
  std::vector<std::string> labels = read_labels(in);
  const Method method = read_name(in, "method", method_from, Method::lda);
  if (!in.ok()) return pass(in.status().error());
  const std::size_t columns = columns_of(setup.channels, setup.features).size();
  auto pipeline = Pipeline::read(in, method, columns, labels.size());
  in.finish();
  if (!in.ok() || !pipeline) return pass(in.status().error());
  return RecordingModel{std::move(provenance), std::move(setup), std::move(labels), method,
                        std::move(*pipeline)};
}

}  // namespace

std::vector<TooShort> too_short_for(const RecordingSetup& setup,
                                    std::span<const Recording> recordings) {
  return lay_out(recordings, setup.window_s, places_in(setup)).too_short;
}

Result<RecordingModel> train_recording_model(std::span<const Recording> recordings,
                                             const RecordingSetup& setup,
                                             const PipelineOptions& options,
                                             Provenance provenance) {
  auto windows = cut_and_extract(recordings, setup.window_s, places_in(setup), setup.features);
  if (!windows) return pass(windows.error());
  const FeatureMatrix& matrix = windows->matrix;
  if (matrix.size() == 0)
    return fail({.code = Errc::invalid_argument,
                 .what = "no recording is as long as a window",
                 .expected = std::to_string(setup.window_s) + " s",
                 .hint = "Take a shorter --window-s"});
  Classes classes = find_classes(matrix);
  for (const TooShort& one : windows->too_short)
    if (!std::ranges::binary_search(classes.labels, one.label))
      return fail({.code = Errc::invalid_argument,
                   .where = one.label,
                   .what = "no recording of the label is as long as a window",
                   .expected = std::to_string(setup.window_s) + " s",
                   .hint = "Take a shorter --window-s"});
  const std::vector<std::size_t> unit = fold_units(*windows, numbers_below(matrix.size()));
  auto pipeline =
      Pipeline::train({&matrix.values, classes.of_row, classes.labels.size(), unit}, options);
  if (!pipeline) return pass(pipeline.error());
  RecordingSetup own = setup;
  own.channels = recordings.front().channels;
  return RecordingModel{std::move(provenance), std::move(own), std::move(classes.labels),
                        options.method, std::move(*pipeline)};
}

Status save_recording_model(const RecordingModel& model, std::ostream& out) {
  LineWriter text;
  write_provenance(text, model.provenance);
  write_setup(text, model.setup);
  write_labels(text, model.labels);
  text.text("method", to_string(model.method));
  model.pipeline.write(text);
  return write_checksummed(recording_model_header, text.str(), out);
}

Result<RecordingModel> load_recording_model(std::istream& in) {
  const auto body = read_checksummed(recording_model_header, "not a model of recordings", in);
  if (!body) return pass(body.error());
  return read_body(*body);
}

Result<std::vector<RecordingAnswer>> classify_recordings(const RecordingModel& model,
                                                         std::span<const Recording> recordings) {
  const RecordingSetup& setup = model.setup;
  for (const Recording& recording : recordings)
    if (!same_sensor(recording.channels, setup.channels))
      return fail({.code = Errc::invalid_argument,
                   .where = recording.file,
                   .what = "the model was trained for another sensor",
                   .expected = format_channels(setup.channels),
                   .got = format_channels(recording.channels)});
  const auto windows =
      cut_and_extract(recordings, setup.window_s, places_in(setup), setup.features);
  if (!windows) return pass(windows.error());
  std::vector<RecordingAnswer> out;
  for (const Recording& recording : recordings)
    out.push_back(
        {recording.file, recording.label, 0, std::vector<std::size_t>(model.labels.size(), 0)});
  for (std::size_t r = 0; r < windows->matrix.size(); ++r) {
    const auto label = model.pipeline.classify(windows->matrix.values.row(r));
    if (!label) return pass(label.error(), windows->matrix.files[r]);
    ++out[windows->recording[r]].windows[*label];
  }
  for (RecordingAnswer& answer : out) {
    answer.label = place_of_largest(answer.windows);
    if (answer.windows[answer.label] == 0)
      return fail({.code = Errc::invalid_argument,
                   .where = answer.file,
                   .what = "the recording is shorter than a window",
                   .expected = std::to_string(setup.window_s) + " s"});
  }
  return out;
}

}  // namespace weft::classifier::vibro
