#include "daemon/storage/recorder/recorder.hpp"

#include <algorithm>
#include <atomic>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/base/version/software_version.hpp"
#include "daemon/storage/recorder/campaign_history.hpp"
#include "daemon/storage/recorder/campaign_writer.hpp"
#include "daemon/storage/recorder/chunk.hpp"
#include "daemon/storage/recorder/writer_thread.hpp"

namespace weft::daemon {
namespace {

/// Rows per stream before a chunk is closed: 82 s at 100 Hz, a whole trial in most recipes.
constexpr std::size_t chunk_rows = 8192;
/// Rows per stream of blocks: 20 s at 50 per second.
constexpr std::size_t chunk_blocks = 1024;

/// Storage format of a stream of blocks.
struct BlockKind {
  Stream stream;
  std::size_t axes;
  const char* unit;
  double quanta_per_unit;
};
constexpr BlockKind acceleration_blocks{Stream::acceleration, acceleration_axes, "m/s2",
                                        acceleration_quanta_per_mps2};
constexpr BlockKind sound_blocks{Stream::sound, 1, "Pa", sound_quanta_per_pa};

tl::unexpected<Error> unlike(Stream stream, std::string what, std::string expected,
                             std::string got) {
  return fail({.code = Errc::invalid_argument,
               .where = std::string(to_string(stream)),
               .what = std::move(what),
               .expected = std::move(expected),
               .got = std::move(got)});
}

std::string format_blocks(std::size_t values, double rate_hz) {
  return std::to_string(values) + " values at " + std::to_string(rate_hz) + " Hz";
}

}  // namespace

struct Recorder::Impl {
  Impl(std::unique_ptr<CampaignWriter> open_writer, const CampaignHeader& header,
       std::filesystem::path file)
      : writer(std::move(open_writer)),
        folder(file.parent_path()),
        axes(header.info.axes),
        buffers{ChunkBuffer(Stream::taxel, header.taxels, chunk_rows),
                ChunkBuffer(Stream::wrench, 6, chunk_rows),
                ChunkBuffer(Stream::stages, header.info.axes.size(), chunk_rows),
                ChunkBuffer(Stream::acceleration, 0, 0), ChunkBuffer(Stream::sound, 0, 0)} {}

  std::unique_ptr<CampaignWriter> writer;
  std::filesystem::path folder;
  std::vector<Axis> axes;
  /// By Stream; the buffers for blocks get their size with the first block.
  std::array<ChunkBuffer, stream_count> buffers;
  std::array<std::int64_t, stream_count> next_chunk_number{};
  std::array<double, stream_count> block_rate_hz{};
  bool trial_open = false;
  bool finished = false;
  std::optional<Error> failure;  ///< the first one; ends all recording
  std::optional<std::chrono::nanoseconds> last_commit;
  std::map<std::uint32_t, std::uint32_t> next_attempts;  ///< for a resumed file
  Continuation continuation;
  std::optional<ReplayVerifier> verifier;  ///< set during the replay
  bool resumed = true;                     ///< false: the file still records the end of the run
  std::atomic<std::int64_t> commit_lag_ns{-1};  ///< longest since commit_lag(); -1: no commit
  std::atomic<bool> has_notice{false};
  std::mutex notice_mutex;
  std::string notice;
  std::unique_ptr<WriterThread> thread;  ///< destroyed before the writer; null: writes are done
                                         ///< immediately

  /// Waits for locks of other programs; take_notice() reports them.
  void wait_for_locks() {
    writer->wait_for_locks([this](std::string text) {
      const std::lock_guard lock(notice_mutex);
      notice = std::move(text);
      has_notice = true;
    });
  }
  Status ready(bool in_trial);
  /// Runs the job on the writer now, or queues it for the thread. Keeps the first failure.
  template <class Job>
  Status write(Job job);
  /// write() of a job that commits, timed for commit_lag().
  template <class Job>
  Status write_commit(Job job);
  /// Nothing is written during the replay, nor before the file records the resume.
  Status resume_recording(TimePoint now);
  Status write_chunk(ChunkBuffer& buffer);
  Status write_chunks();

  ChunkBuffer& buffer(Stream stream) { return buffers[static_cast<std::size_t>(stream)]; }
  /// Adds a row with this stamp; `encode` fills the buffer's slot.
  template <class Encode>
  Status add(Stream stream, const Stamp& stamp, Encode encode);
  Status begin_blocks(const BlockKind& kind, std::size_t values, double rate_hz);
  Status block(const Stamp& stamp, const BlockKind& kind, const BlockRow& row, double rate_hz);
};

Status Recorder::Impl::ready(bool in_trial) {
  if (failure) return tl::unexpected<Error>(*failure);
  if (finished) return fail({.code = Errc::wrong_state, .what = "campaign file already finished"});
  if (trial_open != in_trial)
    return fail({.code = Errc::wrong_state,
                 .what = in_trial ? "no open trial" : "previous trial not ended"});
  return {};
}

template <class Job>
Status Recorder::Impl::write(Job job) {
  if (failure) return tl::unexpected<Error>(*failure);
  Status done = thread ? thread->post([w = writer.get(), job = std::move(job)] { return job(*w); })
                       : job(*writer);
  if (!done) failure = done.error();
  return done;
}

template <class Job>
Status Recorder::Impl::write_commit(Job job) {
  return write([this, begun = steady_wall_now(), job = std::move(job)](CampaignWriter& w) {
    Status done = job(w);
    const std::int64_t lag_ns = (steady_wall_now() - begun).count();
    commit_lag_ns = std::max(commit_lag_ns.load(), lag_ns);  // jobs run one after the other, so
                                                             // this needs no exchange
    return done;
  });
}

Status Recorder::Impl::resume_recording(TimePoint now) {
  if (resumed) return {};
  // Runs here and not on the writer's thread: the bench does not move yet. The recorded end is
  // cleared only if the file can be written.
  Status ok = writer->require_no_reader();
  if (ok && continuation.before_writing) ok = continuation.before_writing();
  if (ok) ok = writer->begin_writing();
  wait_for_locks();
  if (!ok) {
    failure = ok.error();
    return ok;
  }
  const bool is_replayed = verifier.has_value();
  verifier.reset();
  resumed = true;
  const std::string payload = R"({"first_trial":)" + std::to_string(continuation.first_trial) +
                              R"(,"plays_again":)" + (is_replayed ? "true" : "false") +
                              R"(,"software_version":")" + software_version() + "\"}";
  return write([now, payload](CampaignWriter& w) { return w.resumed(now, payload); });
}

Status Recorder::Impl::write_chunk(ChunkBuffer& chunk) {
  if (chunk.empty()) return {};
  if (verifier) {
    verifier->on_rows(chunk.stream(), chunk.bytes());
    chunk.clear();
    return {};
  }
  const auto stream = static_cast<std::size_t>(chunk.stream());
  const ChunkRecord record{static_cast<std::int64_t>(stream),
                           next_chunk_number[stream]++,
                           chunk.first_sequence(),
                           chunk.rows(),
                           chunk.lost_before(),
                           chunk.t0_ns(),
                           chunk.bytes()};
  Status done;
  if (thread) {
    const auto copy = std::make_shared<const Bytes>(chunk.bytes().begin(), chunk.bytes().end());
    done = write([record, copy](CampaignWriter& w) {
      ChunkRecord whole = record;
      whole.bytes = *copy;
      return w.chunk(whole);
    });
  } else {
    done = write([&record](CampaignWriter& w) { return w.chunk(record); });
  }
  if (done) chunk.clear();
  return done;
}

Status Recorder::Impl::write_chunks() {
  for (ChunkBuffer& chunk : buffers)
    if (auto done = write_chunk(chunk); !done) return done;
  return {};
}

template <class Encode>
Status Recorder::Impl::add(Stream stream, const Stamp& stamp, Encode encode) {
  if (auto fine = ready(true); !fine) return pass(std::move(fine).error(), to_string(stream));
  ChunkBuffer& chunk = buffer(stream);
  if (chunk.full() || !chunk.continues(stamp.sequence, stamp.lost))
    if (auto done = write_chunk(chunk); !done) return done;
  if (Status encoded = encode(chunk); !encoded) return encoded;
  chunk.push(stamp.sequence, stamp.lost, stamp.host);
  return {};
}

Status Recorder::Impl::begin_blocks(const BlockKind& kind, std::size_t values, double rate_hz) {
  if (values == 0 || values > most_block_values || values % kind.axes != 0 || !(rate_hz > 0))
    return unlike(kind.stream, "invalid block", "whole readings at a positive rate",
                  format_blocks(values, rate_hz));
  const BlockStreamRecord record{static_cast<std::int64_t>(kind.stream),
                                 {rate_hz, static_cast<std::uint32_t>(values / kind.axes)},
                                 static_cast<std::int64_t>(kind.axes),
                                 kind.unit,
                                 kind.quanta_per_unit};
  if (!verifier)  // otherwise it is on record already
    if (auto done = write([record](CampaignWriter& w) { return w.block_stream(record); }); !done)
      return done;
  block_rate_hz[static_cast<std::size_t>(kind.stream)] = rate_hz;
  buffer(kind.stream) = ChunkBuffer(kind.stream, values, chunk_blocks);
  return {};
}

Status Recorder::Impl::block(const Stamp& stamp, const BlockKind& kind, const BlockRow& row,
                             double rate_hz) {
  if (auto fine = ready(true); !fine) return pass(std::move(fine).error(), to_string(kind.stream));
  double& known_hz = block_rate_hz[static_cast<std::size_t>(kind.stream)];
  if (known_hz == 0)
    if (auto begun = begin_blocks(kind, row.values.size(), rate_hz); !begun) return begun;
  return add(kind.stream, stamp, [&](ChunkBuffer& chunk) -> Status {
    if (row.values.size() != chunk.width() || rate_hz != known_hz)
      return unlike(kind.stream, "block differs from the first",
                    format_blocks(chunk.width(), known_hz),
                    format_blocks(row.values.size(), rate_hz));
    auto done = encode_block(chunk.slot(), stamp.host, row);
    return done ? done : pass(std::move(done).error(), stamp.device);
  });
}

Recorder::Recorder(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Recorder::Recorder(Recorder&&) noexcept = default;
Recorder& Recorder::operator=(Recorder&&) noexcept = default;
Recorder::~Recorder() = default;

Status Recorder::refuse_existing(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return {};
  return fail({.code = Errc::wrong_state,
               .where = path,
               .what = "campaign file already exists",
               .hint = "Resume it with --resume, or choose another folder for a new campaign"});
}

Result<Recorder> Recorder::create(const std::filesystem::path& path, const CampaignHeader& header) {
  if (Status free = refuse_existing(path); !free) return pass(free.error());
  auto writer = CampaignWriter::create(path, header);
  if (!writer) return pass(std::move(writer).error(), path.string());
  Recorder recorder(std::make_unique<Impl>(std::move(*writer), header, path));
  recorder.impl_->wait_for_locks();
  for (const DeviceInfo& device : header.info.devices)
    if (auto stored = recorder.device(device); !stored)
      return pass(std::move(stored).error(), path.string());
  return recorder;
}

Result<Recorder> Recorder::resume(const std::filesystem::path& path, const CampaignHistory& history,
                                  Continuation how) {
  auto writer = CampaignWriter::reopen(path);
  if (!writer) return pass(std::move(writer).error(), path.string());
  CampaignHeader header;
  header.info = history.info;
  header.taxels = history.taxels;
  auto impl = std::make_unique<Impl>(std::move(*writer), header, path);
  impl->next_attempts = history.next_attempts();
  impl->resumed = false;
  if (how.is_replayed) {
    auto verifier = ReplayVerifier::open(path, history, how.first_trial);
    if (!verifier) return pass(verifier.error(), path.string());
    impl->verifier.emplace(std::move(*verifier));
  }
  impl->continuation = std::move(how);
  return Recorder(std::move(impl));
}

bool Recorder::is_replayed() const {
  return impl_->verifier.has_value();
}

Status Recorder::resume_recording(TimePoint now) {
  if (impl_->failure) return tl::unexpected<Error>(*impl_->failure);
  if (impl_->verifier && !impl_->verifier->whole())
    return fail({.code = Errc::wrong_state,
                 .where = "resume",
                 .what = "run ended before its remaining trials",
                 .hint = "Resume it again; nothing was changed"});
  return impl_->resume_recording(now);
}

void Recorder::write_behind() {
  if (impl_->thread) return;
  impl_->writer->sync_commits();
  impl_->thread = std::make_unique<WriterThread>();
}

bool Recorder::writes_behind() const {
  return impl_->thread != nullptr;
}

Status Recorder::device(const DeviceInfo& device) {
  if (impl_->verifier) return {};
  return impl_->write([device](CampaignWriter& w) { return w.device(device); });
}

Status Recorder::begin_trial(const TrialSpec& spec, TimePoint now) {
  if (auto fine = impl_->ready(false); !fine) return fine;
  impl_->next_chunk_number = {};
  if (impl_->verifier && impl_->verifier->covers(spec.index)) {
    impl_->verifier->begin(spec.index);
    impl_->trial_open = true;
    return {};
  }
  if (Status ok = resume_recording(now); !ok) return ok;
  TrialSpec counted = spec;
  if (const auto next = impl_->next_attempts.find(spec.index); next != impl_->next_attempts.end())
    counted.attempt = next->second++;
  Status done =
      impl_->write([counted, now](CampaignWriter& w) { return w.begin_trial(counted, now); });
  impl_->trial_open = done.has_value();
  return done;
}

Status Recorder::taxel(const Stamp& stamp, const TaxelSample& sample, Phase phase) {
  return impl_->add(Stream::taxel, stamp, [&](ChunkBuffer& chunk) -> Status {
    if (sample.counts.size() != chunk.width())
      return unlike(Stream::taxel, "wrong number of taxels in a frame",
                    std::to_string(chunk.width()), std::to_string(sample.counts.size()));
    encode_taxel(chunk.slot(), stamp.host, sample, phase);
    return {};
  });
}

Status Recorder::wrench(const Stamp& stamp, const WrenchSample& sample) {
  return impl_->add(Stream::wrench, stamp, [&](ChunkBuffer& chunk) -> Status {
    auto done = encode_wrench(chunk.slot(), stamp.host, sample);
    return done ? done : pass(std::move(done).error(), stamp.device);
  });
}

Status Recorder::stages(const Stamp& stamp, std::span<const double> positions) {
  return impl_->add(Stream::stages, stamp, [&](ChunkBuffer& chunk) -> Status {
    if (positions.size() != impl_->axes.size())
      return unlike(Stream::stages, "wrong number of axes", std::to_string(impl_->axes.size()),
                    std::to_string(positions.size()));
    return encode_stages(chunk.slot(), stamp.host, positions, impl_->axes);
  });
}

Status Recorder::acceleration(const Stamp& stamp, const AccelerationSample& sample) {
  return impl_->block(
      stamp, acceleration_blocks,
      {sample.device_us, sample.clipped, sample.acceleration_mps2, acceleration_quanta_per_mps2},
      sample.rate_hz);
}

Status Recorder::sound(const Stamp& stamp, const SoundSample& sample) {
  return impl_->block(stamp, sound_blocks,
                      {sample.device_us, sample.clipped, sample.pressure_pa, sound_quanta_per_pa},
                      sample.rate_hz);
}

Status Recorder::end_trial(TrialOutcome outcome, const TrialQuality& quality, TimePoint now) {
  if (auto fine = impl_->ready(true); !fine) return fine;
  impl_->trial_open = false;
  if (Status done = impl_->write_chunks(); !done) return done;
  if (impl_->verifier) {
    Status same = impl_->verifier->end(outcome);
    if (!same) impl_->failure = same.error();
    return same;
  }
  return impl_->write_commit(
      [outcome, quality, now](CampaignWriter& w) { return w.end_trial(outcome, quality, now); });
}

Status Recorder::journal(TimePoint now, std::string_view kind, std::string_view payload_json) {
  if (!impl_->failure && impl_->finished)
    return fail({.code = Errc::wrong_state, .what = "campaign file already finished"});
  if (impl_->verifier) return {};
  return impl_->write([now, what = std::string(kind), payload = std::string(payload_json)](
                          CampaignWriter& w) { return w.journal(now, what, payload); });
}

Status Recorder::commit_if_due(std::chrono::nanoseconds steady_wall) {
  if (!impl_->last_commit) impl_->last_commit = steady_wall;
  // The thread needs part of the budget.
  const auto budget = impl_->thread ? commit_budget / 2 : commit_budget;
  if (steady_wall - *impl_->last_commit < budget) {
    if (impl_->failure) return tl::unexpected<Error>(*impl_->failure);
    return {};
  }
  impl_->last_commit = steady_wall;
  return commit();
}

Status Recorder::commit() {
  if (Status done = impl_->write_chunks(); !done) return done;
  return impl_->write_commit([](CampaignWriter& w) { return w.commit(); });
}

std::optional<std::chrono::nanoseconds> Recorder::commit_lag() {
  const std::int64_t lag_ns = impl_->commit_lag_ns.exchange(-1);
  if (lag_ns < 0) return std::nullopt;
  return std::chrono::nanoseconds(lag_ns);
}

std::optional<std::string> Recorder::take_notice() {
  if (!impl_->has_notice.exchange(false)) return std::nullopt;
  const std::lock_guard lock(impl_->notice_mutex);
  return std::exchange(impl_->notice, {});
}

Status Recorder::finish() {
  if (auto fine = impl_->ready(false); !fine) return fine;
  Status done = impl_->write([](CampaignWriter& w) { return w.finish(); });
  if (done && impl_->thread) done = impl_->thread->drain();
  if (!done && !impl_->failure) impl_->failure = done.error();
  impl_->finished = done.has_value();
  return done;
}

std::optional<std::uint64_t> Recorder::free_bytes() const {
  std::error_code error;
  const auto space = std::filesystem::space(impl_->folder, error);
  if (error) return std::nullopt;
  return space.available;
}

}  // namespace weft::daemon
