#include "daemon/service/daemon/weftd.hpp"

#include <sys/random.h>

#include <nlohmann/json.hpp>

#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/service/methods/services.hpp"
#include "daemon/service/rpc/idempotency.hpp"
#include "daemon/service/rpc/tokens.hpp"
#include "daemon/service/rpc/worker_queue.hpp"
#include "daemon/service/transport/http_server.hpp"
#include "daemon/service/transport/socket_server.hpp"

namespace weft::daemon::server {
namespace {

std::string new_epoch() {
  std::uint32_t bits = 0;
  if (getrandom(&bits, sizeof bits, 0) != sizeof bits)
    bits = static_cast<std::uint32_t>(utc_now().count());
  char text[16];
  std::snprintf(text, sizeof text, "%08x", bits);
  return text;
}

std::filesystem::path or_in(const std::filesystem::path& given, const std::filesystem::path& folder,
                            const char* name) {
  return given.empty() ? folder / name : given;
}

Status make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = folder.string(),
                 .what = "cannot make the folder",
                 .got = error.message()});
  return {};
}

/// One wording for all that can be wrong with a token.
Result<TokenOwner> find_token_owner(access::TokenKeeper& tokens, std::string_view token,
                                    std::int64_t utc_us) {
  if (const auto entry = tokens.find(token, utc_us))
    return TokenOwner{access::user_of(*entry), entry->role, *entry};
  return fail({.code = Errc::wrong_state,
               .where = "/params/token",
               .what = "this token is not, or no more, good for anything",
               .hint = "weft token add makes one"});
}

api::Services::BackgroundTask background_of(WorkerQueue& workers) {
  return [&workers](WorkerQueue::Work work, WorkerQueue::Failed failed) {
    return workers.send(std::move(work), std::move(failed));
  };
}

/// All parts of a daemon, in the order in which they need each other.
class Daemon final : private runs::RunObserver {
 public:
  /// `own`: where the daemon is there for that run alone; outlives it.
  static Result<std::unique_ptr<Daemon>> open(const DaemonOptions& options,
                                              const EmbeddedRun* own = nullptr);
  ~Daemon() override { ending_ = true; }
  /// Returns the run that does not answer any more, where there is one: its thread holds on to all
  /// of the daemon, which may not be destroyed under it.
  std::optional<std::string> run(const std::atomic<bool>& stop,
                                 const std::function<void(const Ports&)>& ready);
  /// Until the daemon's own run has ended. Errors: RunManager::submit()'s.
  Status run_own();

 private:
  Daemon(access::TokenKeeper tokens, runs::RunStore log)
      : tokens_(std::move(tokens)), log_(std::move(log)) {}
  api::Services services_for(const DaemonOptions& options);
  void wire(const DaemonOptions& options);
  runs::RunContext run_context(const DaemonOptions& options);
  Status load_tls(const DaemonOptions& options);
  Status begin(const DaemonOptions& options);
  /// Never goes back: what has expired stays so, and the journal's times rise with its numbers.
  std::int64_t utc_us() { return utc_.now(utc_now(), steady_wall_now()).count() / 1000; }
  void on_run_changed(const runs::RunView& run) override;
  void on_run_unloaded(std::int64_t run) override;
  void on_vote(const runs::RunView& run) override;
  void on_queue_changed(const runs::RunQueue& queue, std::string_view by) override;
  void on_rig_state_changed(const runs::RigState& rig, std::string_view by) override;
  void check_tokens();
  void tick();
  void show_samples();

  const EmbeddedRun* own_ = nullptr;
  BenchPace pace_ = 0;
  LiveFrameSampler frame_sampler_;
  MonotonicUtcClock utc_;
  access::TokenKeeper tokens_;
  Clock tokens_seen_{};         ///< when the file was looked at
  bool tokens_unread_ = false;  ///< the journal has it that the file cannot be read
  access::IdempotencyCache answered_;
  const std::string epoch_ = new_epoch();
  access::Leases leases_{epoch_};
  Hub hub_;
  rpc::Methods methods_;
  std::atomic<bool> ending_ = false;
  api::DataFiles files_{utc_now, [this] { return ending_.load(std::memory_order_relaxed); }};
  api::Services services_;
  Shared shared_;
  runs::RunStore log_;
  access::AnswerStore answers_{log_.database()};
  std::shared_ptr<asio::ssl::context> tls_;  // before those who use it
  std::unique_ptr<SocketServer> server_;
  std::unique_ptr<HttpServer> http_;
  const std::function<void(std::function<void()>)> post_ = [this](std::function<void()> work) {
    server_->post(std::move(work));
  };
  // Their threads begin at once, so nothing is sent to them before begin() has made server_. They
  // are gone before the server, to which they post.
  WorkerQueue workers_{post_}, change_workers_{post_}, file_workers_{post_};
  std::unique_ptr<runs::RunManager> manager_;  // gone first: its threads post to the server
  std::unique_ptr<handover::HandoverService> handovers_;  // likewise, and uses the manager
};

Result<std::unique_ptr<Daemon>> Daemon::open(const DaemonOptions& options, const EmbeddedRun* own) {
  if (Status made = make_folder(options.data); !made) return pass(made.error());
  auto tokens = access::TokenKeeper::open(or_in(options.tokens, options.data, "tokens.json"));
  if (!tokens) return pass(tokens.error());
  auto log = runs::RunStore::open(own ? ":memory:" : options.data / runs::store_file_name);
  if (!log) return pass(log.error());
  std::unique_ptr<Daemon> daemon(new Daemon(std::move(*tokens), std::move(*log)));
  daemon->own_ = own;
  if (Status begun = daemon->begin(options); !begun) return pass(begun.error());
  return daemon;
}

api::Services Daemon::services_for(const DaemonOptions& options) {
  return {.hub = &hub_,
          .leases = &leases_,
          .run_manager = nullptr,
          .log = &log_,
          .rig = options.rig,
          .rig_name = options.rig.stem().string(),
          .recipes = options.recipes,
          .data = options.data,
          .epoch = epoch_,
          .now = [] { return steady_wall_now(); },
          .utc_us = [this] { return utc_us(); },
          .background = background_of(workers_),
          .change_background = background_of(change_workers_),
          .file_background = background_of(file_workers_),
          .files = &files_,
          .pace = &pace_,
          .add_token = [this](std::string name, access::Role role, std::int64_t expires_us,
                              std::string user) -> Result<std::string> {
            if (own_ != nullptr)
              return fail({.code = Errc::wrong_state,
                           .what = "a daemon inside weft run has no tokens",
                           .hint = "It is there for this machine's users alone"});
            return tokens_.add(std::move(name), role, expires_us, std::move(user), utc_us());
          },
          .remove_token = [this](std::string_view name) { return tokens_.remove(name); },
          .tokens_problem = [this] { return tokens_.problem(); },
          .one_run = own_ != nullptr};
}

void Daemon::wire(const DaemonOptions& options) {
  services_ = services_for(options);
  pace_ = options.pace;
  shared_.methods = &methods_;
  shared_.hub = &hub_;
  shared_.answered = &answered_;
  shared_.epoch = services_.epoch;
  shared_.token_owner = [this](std::string_view token) {
    return find_token_owner(tokens_, token, utc_us());
  };
  shared_.is_token_valid = [this](const TokenOwner& owner) {
    return tokens_.is_valid(owner.token, utc_us());
  };
  shared_.readiness_json = [this] { return api::readiness_json(services_); };
  shared_.halt = [this](const rpc::Caller& caller) {
    services_.run_manager->halt(runs::RigState::Stop::halt, rpc::by(caller));
  };
  shared_.emergency_stop = [this](const rpc::Caller& caller) {
    services_.run_manager->halt(runs::RigState::Stop::emergency, rpc::by(caller));
  };
  services_.sessions = &shared_.sessions;
  shared_.now = [] { return steady_wall_now(); };
  shared_.file = [this](std::string_view path, const Shared::FileCallback& callback) {
    api::open_served_file(services_, path, callback);
  };
  api::add_methods(methods_, services_);
}

Status Daemon::load_tls(const DaemonOptions& options) {
  if (options.tls_certificate.empty() && options.tls_key.empty()) return {};
  if (options.tls_certificate.empty() || options.tls_key.empty())
    return fail({.code = Errc::invalid_argument,
                 .where = "--tls-cert",
                 .what = "a certificate and its key go together",
                 .expected = "--tls-cert and --tls-key"});
  auto tls = server::load_tls(options.tls_certificate, options.tls_key);
  if (!tls) return pass(tls.error(), "TLS");
  tls_ = std::move(*tls);
  return {};
}

runs::RunContext Daemon::run_context(const DaemonOptions& options) {
  return {.rig = options.rig,
          .data = options.data,
          .post = post_,
          .now = [] { return steady_wall_now(); },
          .utc_us = [this] { return utc_us(); },
          .observer = this,
          .frame_sampler = &frame_sampler_,
          .pace = &pace_,
          .wall_us = [] { return utc_now().count() / 1000; },
          .find_handover = [this](std::int64_t run) -> std::optional<HandoverStatus> {
            return handovers_ ? handovers_->get(runs::run_id(run)) : std::nullopt;
          },
          .perform =
              [this](const CampaignRequest& request, const CampaignHooks& hooks) {
                return own_ ? own_->perform(hooks) : run_campaign(request, hooks);
              },
          .one_run = own_ != nullptr};
}

Status Daemon::begin(const DaemonOptions& options) {
  if (!is_pace(options.pace))
    return fail({.code = Errc::range,
                 .where = "--pace",
                 .what = "no such pace",
                 .expected = "0, or 1 to 1 000 000",
                 .got = std::to_string(options.pace),
                 .hint = "0 lets a simulated bench go as fast as it can"});
  wire(options);
  if (Status ok = load_tls(options); !ok) return ok;
  const auto address = address_to_listen_on(options.listen, tls_ != nullptr);
  if (!address) return pass(address.error());
  auto server = SocketServer::open(
      {or_in(options.socket, options.data, "weftd.sock"), options.port, *address, tls_.get()},
      shared_, {});
  if (!server) return pass(server.error());
  server_ = std::move(*server);
  manager_ = std::make_unique<runs::RunManager>(run_context(options), log_);
  answered_.remember_in(answers_, [this] { return utc_us(); });
  services_.run_manager = manager_.get();
  handovers_ = std::make_unique<handover::HandoverService>(
      handover::HandoverContext{.post = post_,
                                .utc_us = [this] { return utc_us(); },
                                .on_changed =
                                    [this](std::string_view run, const HandoverStatus&) {
                                      manager_->notify_changed(run, "auto:hand_over");
                                    }},
      log_);
  services_.handovers = handovers_.get();
  if (options.http_port) {
    auto http = HttpServer::open(server_->context(), {*options.http_port, *address, tls_.get()},
                                 shared_, {});
    if (!http) return pass(http.error());
    http_ = std::move(*http);
    services_.http_url = http_url(*address, http_->port(), tls_ != nullptr);
  }
  hub_.on_news([this] {
    server_->pump();
    if (http_) http_->pump();
  });
  hub_.archive_in(api::run_archive(services_));
  for (const runs::RunView& run : manager_->loaded()) on_run_changed(run);
  if (own_ == nullptr) handovers_->resume();
  hub_.publish("rig", api::rig_delta(manager_->rig_state(), "auto:daemon"), utc_us());
  return log_.append_journal(utc_us(), "", "daemon.started", "auto:daemon");
}

void Daemon::on_run_changed(const runs::RunView& run) {
  nlohmann::json delta = api::run_json(run);
  // A patch that leaves something out takes nothing away: what a recovery has cleared is told.
  for (const char* const gone :
       {"outcome", "cleanup", "rig", "error", "dataset_error", "dataset_sha256", "campaign_since"})
    if (!delta.contains(gone)) delta[gone] = nullptr;
  hub_.publish("run:" + run.stored.id(), delta, utc_us());
  if (handovers_ && own_ == nullptr)  // `weft run` does that itself
    handovers_->consider(run.stored, run.has_handover);
}

void Daemon::on_run_unloaded(std::int64_t run) {
  hub_.forget("run:" + runs::run_id(run));
  hub_.forget("vote:" + runs::run_id(run));
}

void Daemon::on_vote(const runs::RunView& run) {
  hub_.publish("vote:" + run.stored.id(), api::vote_json(*run.vote), utc_us());
}

void Daemon::on_rig_state_changed(const runs::RigState& rig, std::string_view by) {
  hub_.publish("rig", api::rig_delta(rig, by), utc_us());
}

void Daemon::on_queue_changed(const runs::RunQueue& queue, std::string_view by) {
  nlohmann::json delta = api::queue_json(queue);
  delta["by"] = by;
  hub_.publish("queue", delta, utc_us());
}

// Each tick at most one frame: whoever looks on costs the run nothing more.
void Daemon::show_samples() {
  const bool wanted = api::wants_samples(hub_);
  frame_sampler_.set_active(wanted);
  if (!wanted) return;
  const auto run = manager_->active();
  const auto frame = frame_sampler_.take();
  if (run && frame) api::pass_on(hub_, *frame, *run, utc_us());
}

// A token that was removed ends what it was good for, within a second; where that cannot be seen it
// is said.
void Daemon::check_tokens() {
  using namespace std::chrono_literals;
  const Clock now = steady_wall_now();
  if (now - tokens_seen_ < 1s) return;
  tokens_seen_ = now;
  tokens_.refresh();
  const auto& problem = tokens_.problem();
  if (problem && !std::exchange(tokens_unread_, true))
    static_cast<void>(log_.append_journal(utc_us(), "", "tokens.unreadable", "auto:daemon",
                                          nlohmann::json{{"error", to_string(*problem)}}.dump()));
  if (!problem) tokens_unread_ = false;
}

void Daemon::tick() {
  check_tokens();
  show_samples();
  if (http_) http_->pump();
  manager_->tick();
  for (const access::Lease& lease : leases_.expire(steady_wall_now()))
    api::notify_lease_expired(services_, lease);
}

std::optional<std::string> Daemon::run(const std::atomic<bool>& stop,
                                       const std::function<void(const Ports&)>& ready) {
  ready({server_->port(), http_ ? http_->port() : std::uint16_t{0}});
  server_->run([this, &stop] {
    tick();
    if (!stop.load(std::memory_order_relaxed)) return;
    manager_->close();
    // Else what became of a run would not be written down.
    if (manager_->status().is_at_rest) server_->stop();
  });
  auto lost = manager_->status().unresponsive;
  if (lost) handovers_->put_off();
  return lost;
}

Status Daemon::run_own() {
  const auto run = manager_->submit(own_->request, own_->check());
  if (!run) return pass(run.error());
  // Who looks on is told the end.
  constexpr Clock repeat_after = std::chrono::milliseconds(200), to_read = std::chrono::seconds(2);
  std::optional<Clock> since;
  server_->run([&] {
    tick();
    if (manager_->active()) return;
    const Clock now = steady_wall_now();
    if (!since) since = now;
    const Clock over = now - *since;
    if (server_->connections() == 0 || over > to_read ||
        (over > repeat_after && !server_->has_unsent()))
      server_->stop();
  });
  return {};
}

}  // namespace

Status run_daemon(const DaemonOptions& options, const std::atomic<bool>& stop,
                  const std::function<void(const Ports&)>& ready) {
  auto daemon = Daemon::open(options);
  if (!daemon) return pass(daemon.error());
  const auto lost = (*daemon)->run(stop, ready);
  if (!lost) return {};
  static_cast<void>(daemon->release());
  return fail({.code = Errc::timeout,
               .where = *lost,
               .what = "a run does not answer, and the daemon ends without it",
               .hint = "weft status says how the rig stands, once weftd is started again"});
}

Status run_daemon_for(const DaemonOptions& options, const EmbeddedRun& own) {
  auto daemon = Daemon::open(options, &own);
  if (!daemon) return pass(daemon.error());
  return (*daemon)->run_own();
}

}  // namespace weft::daemon::server
