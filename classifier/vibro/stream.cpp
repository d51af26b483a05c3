#include "classifier/vibro/stream.hpp"

#include <algorithm>
#include <string>

#include "classifier/features/feature_stream.hpp"

namespace weft::classifier::vibro {

Result<WindowStream> WindowStream::make(std::vector<Channel> channels, FeatureChoice choice,
                                        Timing timing) {
  auto extractor = WindowExtractor::make(std::move(channels), choice);
  if (!extractor) return pass(extractor.error());
  for (const double seconds : {timing.window_s, timing.step_s}) {
    for (const Channel& c : extractor->channels()) {
      const double samples = seconds * c.rate_hz;
      if (!(samples >= 1.0) || samples > static_cast<double>(ChannelExtractor::most_samples))
        return fail(
            {.code = Errc::invalid_argument,
             .where = c.name,
             .what = "window or step out of range",
             .expected = "1 to " + std::to_string(ChannelExtractor::most_samples) + " samples",
             .got = std::to_string(samples)});
    }
  }
  return WindowStream(std::move(*extractor), timing);
}

WindowStream::WindowStream(WindowExtractor extractor, Timing timing)
    : extractor_(std::move(extractor)), timing_(timing), waiting_(extractor_.channels().size()) {}

Status WindowStream::add(std::size_t channel, std::span<const double> samples) {
  if (channel >= waiting_.size())
    return fail({.code = Errc::invalid_argument,
                 .what = "channel number out of range",
                 .expected = "less than " + std::to_string(waiting_.size()),
                 .got = std::to_string(channel)});
  Waiting& own = waiting_[channel];
  if (const std::size_t bad = first_not_finite(samples); bad < samples.size())
    return fail({.code = Errc::invalid_argument,
                 .where = extractor_.channels()[channel].name + ": sample " +
                          std::to_string(own.dropped + own.retained.size() + bad),
                 .what = "sample not finite",
                 .expected = "a finite number",
                 .got = std::to_string(samples[bad])});
  own.retained.insert(own.retained.end(), samples.begin(), samples.end());
  return {};
}

Result<std::optional<std::span<const double>>> WindowStream::next() {
  const double start_s = static_cast<double>(taken_) * timing_.step_s;
  WindowView window;
  for (std::size_t c = 0; c < waiting_.size(); ++c) {
    const double rate = extractor_.channels()[c].rate_hz;
    const std::size_t first = first_sample(start_s, rate);
    const std::size_t count = samples_in(timing_.window_s, rate);
    Waiting& own = waiting_[c];
    // Drops the samples before this window. Done before the check of the window, never after it.
    const std::size_t past =
        std::min(std::max(first, own.dropped) - own.dropped, own.retained.size());
    own.retained.erase(own.retained.begin(),
                       own.retained.begin() + static_cast<std::ptrdiff_t>(past));
    own.dropped += past;
    if (own.dropped < first || own.retained.size() < count)
      return std::optional<std::span<const double>>();
    window.push_back(std::span<const double>(own.retained).first(count));
  }
  const auto row = extractor_.features(window);
  if (!row) return pass(row.error(), "window " + std::to_string(taken_));
  ++taken_;
  return std::optional<std::span<const double>>(*row);
}

}  // namespace weft::classifier::vibro
