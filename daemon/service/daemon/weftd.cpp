#include "daemon/service/daemon/weftd.hpp"

#include <sys/random.h>

#include <asio/ip/host_name.hpp>
#include <nlohmann/json.hpp>

#include "daemon/base/file/read_file.hpp"
#include "daemon/base/file/sha256.hpp"
#include "daemon/base/loop/wall_clock.hpp"
#include "daemon/campaign/bench_check.hpp"
#include "daemon/service/daemon/daemon_log.hpp"
#include "daemon/service/daemon/metrics.hpp"
#include "daemon/service/daemon/service_notifier.hpp"
#include "daemon/service/daemon/token_access.hpp"
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

/// Stable over restarts and unique per daemon: a broker uses it to end the previous session. Empty
/// without notifications, because computing it loads 2 MB of OpenSSL.
std::string client_name(const DaemonOptions& options) {
  if (options.notify.empty()) return {};
  std::error_code unknown;
  const std::string host = asio::ip::host_name(unknown);
  const auto machine = read_text_file("/etc/machine-id");
  const std::string what = host + "\n" + machine.value_or("") + "\n" + options.data.string();
  return "weftd-" + sha256_hex(what).substr(0, 16);
}

Status make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error)
    return fail({.code = Errc::io,
                 .where = folder.string(),
                 .what = "folder not created",
                 .got = error.message()});
  return {};
}

api::Services::BackgroundTask background_of(WorkerQueue& workers) {
  return [&workers](WorkerQueue::Work work, WorkerQueue::Failed failed) {
    return workers.send(std::move(work), std::move(failed));
  };
}

/// All parts of a daemon, in the order of their dependencies.
class Daemon final : private runs::RunObserver {
 public:
  /// `own`: if set, the daemon serves that run only; it must outlive the daemon.
  static Result<std::unique_ptr<Daemon>> open(const DaemonOptions& options,
                                              const EmbeddedRun* own = nullptr);
  ~Daemon() override { ending_ = true; }
  /// Returns the run that no longer responds, if any. Its thread uses all of the daemon, which must
  /// then not be destroyed.
  std::optional<std::string> run(const DaemonOptions& options, const DaemonSignals& signals);
  /// Serves until the daemon's own run has ended. Errors: those of RunManager::submit().
  Status run_own();

 private:
  Daemon(access::TokenKeeper tokens, std::unique_ptr<DaemonLog> output, runs::RunStore log)
      : tokens_(std::move(tokens),
                [this](std::string_view kind, const nlohmann::json& payload) {
                  journal(kind, payload);
                }),
        output_(std::move(output)),
        log_(std::move(log)) {}
  api::Services services_for(const DaemonOptions& options);
  void wire(const DaemonOptions& options);
  runs::RunContext run_context(const DaemonOptions& options);
  Status begin(const DaemonOptions& options);
  Status begin_lab(const DaemonOptions& options);
  /// Never goes back: expired tokens stay expired, and journal times increase with their numbers.
  std::int64_t utc_us() { return utc_.now(utc_now(), steady_wall_now()).count() / 1000; }
  void on_run_changed(const runs::RunView& run) override;
  void on_run_unloaded(std::int64_t run) override;
  void on_vote(const runs::RunView& run) override;
  void on_queue_changed(const runs::RunQueue& queue, std::string_view by) override;
  void on_rig_state_changed(const runs::RigState& rig, std::string_view by) override;
  void journal(std::string_view kind, const nlohmann::json& payload);
  void reload(const DaemonOptions& options);
  void end_runs();
  /// As in `rig.state`: "latched", "moving", ...
  [[nodiscard]] std::string rig_text() const;
  [[nodiscard]] std::string status_text() const;
  void tick();

  const EmbeddedRun* own_ = nullptr;
  BenchPace pace_ = 0;
  LiveFrameSampler frame_sampler_;
  MonotonicUtcClock utc_;
  TokenAccess tokens_;
  ServiceNotifier notifier_;
  access::IdempotencyCache answered_;
  const std::string epoch_ = new_epoch();
  access::Leases leases_{epoch_};
  Hub hub_;
  rpc::Methods methods_;
  std::atomic<bool> ending_ = false;
  api::DataFiles files_{utc_now, [this] { return ending_.load(std::memory_order_relaxed); }};
  api::Services services_;
  Shared shared_;
  std::unique_ptr<DaemonLog> output_;  ///< none in `weft run`, which has its own output
  runs::RunStore log_;
  access::AnswerStore answers_{log_.database()};
  std::shared_ptr<asio::ssl::context> tls_;  // declared before its users
  std::unique_ptr<notify::Notifier> event_notifier_;
  std::unique_ptr<SocketServer> server_;
  std::unique_ptr<HttpServer> http_;
  const std::function<void(std::function<void()>)> post_ = [this](std::function<void()> work) {
    server_->post(std::move(work));
  };
  // Their threads start immediately, so nothing is sent to them before begin() has set server_.
  // They are destroyed before the server, to which they post.
  WorkerQueue workers_{post_}, change_workers_{post_}, file_workers_{post_};
  std::unique_ptr<runs::RunManager> manager_;  // destroyed early: its threads post to the server
  std::unique_ptr<handover::HandoverService> handovers_;  // as manager_, and uses it
  std::unique_ptr<lab::LabAgent> lab_;                    // the same
};

Result<std::unique_ptr<Daemon>> Daemon::open(const DaemonOptions& options, const EmbeddedRun* own) {
  if (Status made = make_folder(options.data); !made) return pass(made.error());
  auto tokens = access::TokenKeeper::open(or_in(options.tokens, options.data, "tokens.json"));
  if (!tokens) return pass(tokens.error());
  auto output = own ? nullptr : std::make_unique<DaemonLog>(options.log_format);
  auto log =
      runs::RunStore::open(own ? ":memory:" : options.data / runs::store_file_name,
                           [out = output.get()](const runs::JournalLine& line, bool is_written) {
                             if (out != nullptr) out->write(line, is_written);
                           });
  if (!log) return pass(log.error());
  std::unique_ptr<Daemon> daemon(
      new Daemon(std::move(*tokens), std::move(output), std::move(*log)));
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
          .frame_sampler = &frame_sampler_,
          .add_token = [this](std::string name, access::Role role, std::int64_t expires_us,
                              std::string user) -> Result<std::string> {
            if (own_ != nullptr)
              return fail({.code = Errc::wrong_state,
                           .what = "tokens not available in the daemon of a weft run",
                           .hint = "Connect through the Unix socket on this machine"});
            return tokens_.keeper().add(std::move(name), role, expires_us, std::move(user),
                                        utc_us());
          },
          .remove_token = [this](std::string_view name) { return tokens_.keeper().remove(name); },
          .tokens_problem = [this] { return tokens_.keeper().problem(); },
          .one_run = own_ != nullptr};
}

void Daemon::wire(const DaemonOptions& options) {
  services_ = services_for(options);
  pace_ = options.pace;
  shared_.methods = &methods_;
  shared_.hub = &hub_;
  shared_.answered = &answered_;
  shared_.epoch = services_.epoch;
  shared_.token_owner = [this](std::string_view token) { return tokens_.owner(token, utc_us()); };
  shared_.on_token_refused = [this](std::string_view from) {
    tokens_.on_refused(from, steady_wall_now());
  };
  shared_.is_token_valid = [this](const TokenOwner& owner) {
    return tokens_.keeper().is_valid(owner.token, utc_us());
  };
  shared_.readiness_json = [this] { return api::readiness_json(services_); };
  shared_.halt = [this](const rpc::Caller& caller) {
    services_.run_manager->halt(runs::RigState::Stop::halt, rpc::by(caller));
  };
  shared_.emergency_stop = [this](const rpc::Caller& caller) {
    services_.run_manager->halt(runs::RigState::Stop::emergency, rpc::by(caller));
  };
  shared_.metrics_text = [this](bool is_open_metrics) {
    return metrics_text({services_, shared_, *event_notifier_}, is_open_metrics);
  };
  services_.sessions = &shared_.sessions;
  shared_.now = [] { return steady_wall_now(); };
  shared_.file = [this](std::string_view path, const Shared::FileCallback& callback) {
    api::open_served_file(services_, path, callback);
  };
  api::add_methods(methods_, services_);
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
                 .what = "pace out of range",
                 .expected = "0, or 1 to 1 000 000",
                 .got = std::to_string(options.pace),
                 .hint = "Use 0 to run a simulated bench as fast as possible"});
  wire(options);
  auto tls = load_tls(options.tls_certificate, options.tls_key);
  if (!tls) return pass(tls.error(), "TLS");
  tls_ = std::move(*tls);
  const auto address = address_to_listen_on(options.listen, tls_ != nullptr);
  if (!address) return pass(address.error());
  auto server = SocketServer::open(
      {or_in(options.socket, options.data, "weftd.sock"), options.port, *address, tls_.get()},
      shared_, {});
  if (!server) return pass(server.error());
  server_ = std::move(*server);
  auto notifier = notify::Notifier::open({.bench = services_.rig_name,
                                          .client = client_name(options),
                                          .data = options.data,
                                          .log = &log_,
                                          .utc_us = services_.utc_us,
                                          .now = services_.now},
                                         options.notify);
  if (!notifier) return pass(notifier.error());
  event_notifier_ = std::move(*notifier);
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
  if (Status begun = begin_lab(options); !begun) return begun;
  for (const runs::RunView& run : manager_->loaded()) on_run_changed(run);
  for (const std::int64_t number : log_.cut_by_restart())
    if (const auto run = manager_->get(runs::run_id(number)))
      event_notifier_->on_cut_by_restart(*run);
  if (own_ == nullptr) handovers_->resume();
  on_rig_state_changed(manager_->rig_state(), "auto:daemon");
  return log_.append_journal(utc_us(), "", "daemon.started", "auto:daemon");
}

Status Daemon::begin_lab(const DaemonOptions& options) {
  if (options.lab.empty()) return {};
  auto address = lab::LabAddress::parse(options.lab);
  if (!address) return pass(address.error(), "--lab");
  const auto socket = std::filesystem::absolute(or_in(options.socket, options.data, "weftd.sock"));
  std::error_code unknown;
  const std::string host =
      options.listen == "127.0.0.1" ? options.listen : asio::ip::host_name(unknown);
  std::string page_url;
  if (http_)
    page_url = (tls_ ? "https://" : "http://") + host + ":" + std::to_string(http_->port());
  auto agent =
      lab::LabAgent::open({.address = std::move(*address),
                           .rig_name = services_.rig_name,
                           .api_address = options.port ? (tls_ ? "tls://" : "tcp://") + host + ":" +
                                                             std::to_string(server_->port())
                                                       : "unix:" + socket.string(),
                           .http_url = page_url,
                           .rig = options.rig,
                           .data = options.data,
                           .manager = manager_.get(),
                           .store = &log_,
                           .post = post_,
                           .utc_us = [this] { return utc_us(); },
                           .now = services_.now,
                           .rig_text = [this] { return rig_text(); },
                           .lease_holder = [this]() -> lab::LabAgentContext::LeaseHolder {
                             const auto held =
                                 leases_.holder("rig:" + services_.rig_name, steady_wall_now());
                             if (!held) return {};
                             return {held->id, held->user};
                           },
                           .background = services_.change_background,
                           .lease = options.lab_lease});
  if (!agent) return pass(agent.error());
  lab_ = std::move(*agent);
  services_.lab = lab_.get();
  return {};
}

void Daemon::on_run_changed(const runs::RunView& run) {
  nlohmann::json delta = api::run_json(run);
  // A merge patch keeps absent members, so members that a recovery has cleared are sent as null.
  for (const char* const gone :
       {"outcome", "cleanup", "rig", "error", "dataset_error", "dataset_sha256", "campaign_since",
        "after", "blocked", "pause_carried_over"})
    if (!delta.contains(gone)) delta[gone] = nullptr;
  hub_.publish("run:" + run.stored.id(), delta, utc_us());
  api::keep_lease(services_, run);
  if (lab_) lab_->on_run(run);
  event_notifier_->on_run(run);
  event_notifier_->on_rig(manager_->rig_state(), rig_text());
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
  hub_.publish("rig", api::rig_delta(*manager_, by), utc_us());
  event_notifier_->on_rig(rig, rig_text());
}

void Daemon::on_queue_changed(const runs::RunQueue& queue, std::string_view by) {
  nlohmann::json delta = api::queue_json(queue);
  delta["by"] = by;
  hub_.publish("queue", delta, utc_us());
  event_notifier_->on_queue(queue);
}

void Daemon::journal(std::string_view kind, const nlohmann::json& payload) {
  log_.persist(
      {.journal = {
           {0, utc_us(), {}, std::string(kind), "auto:daemon", rpc::format_text(payload)}}});
}

// Each part is reloaded separately: a bad certificate must not keep new tokens from being read.
void Daemon::reload(const DaemonOptions& options) {
  notifier_.reloading(steady_wall_now());
  nlohmann::json reloaded = nlohmann::json::array();
  std::string errors;
  const auto note = [&](const char* part, const Status& done) {
    if (done)
      reloaded.push_back(part);
    else
      errors += (errors.empty() ? "" : "; ") + to_string(done.error());
  };
  note("tokens", tokens_.reload());
  if (tls_) note("certificate", reload_tls(*tls_, options.tls_certificate, options.tls_key));
  nlohmann::json payload{{"reloaded", std::move(reloaded)}};
  if (!errors.empty()) payload["error"] = errors;
  journal("daemon.reloaded", payload);
  notifier_.ready();
}

void Daemon::tick() {
  tokens_.tick(steady_wall_now());
  api::publish_samples(hub_, frame_sampler_, *manager_, utc_us());
  if (http_) http_->pump();
  manager_->tick();
  if (lab_) lab_->tick();
  event_notifier_->tick();
  for (const access::Lease& lease : leases_.expire(steady_wall_now()))
    api::notify_lease_expired(services_, lease);
}

std::string Daemon::rig_text() const {
  return api::rig_json(*manager_).at("rig").get<std::string>();
}

std::string Daemon::status_text() const {
  std::string out = services_.rig_name + " " + rig_text();
  if (const auto id = manager_->active())
    if (const auto run = manager_->get(*id))
      out += "; " + *id + " " + std::string(to_string(run->state()));
  return out + "; " + std::to_string(manager_->queue().runs().size()) + " queued";
}

// Ends the loop only when the manager is at rest; otherwise the end of a run would not be recorded.
void Daemon::end_runs() {
  if (lab_) lab_->close();
  manager_->close();
  const runs::ManagerStatus now = manager_->status();
  notifier_.stopping(steady_wall_now(), now.deadline);
  if (now.is_at_rest) server_->stop();
}

std::optional<std::string> Daemon::run(const DaemonOptions& options, const DaemonSignals& signals) {
  output_->start(
      format_places(options.listen, server_->port(), http_ ? http_->port() : 0, tls_ != nullptr));
  notifier_.ready();
  server_->run([&] {
    tick();
    notifier_.tick(steady_wall_now(), [this] { return status_text(); });
    if (signals.stop.load(std::memory_order_relaxed))
      end_runs();
    else if (signals.reload.exchange(false))
      reload(options);
  });
  tokens_.close();
  event_notifier_->close();  // also when the process must end immediately
  auto lost = manager_->status().unresponsive;
  if (lost) handovers_->put_off();
  if (lost) static_cast<void>(output_->drain());  // the process ends without destroying it
  return lost;
}

Status Daemon::run_own() {
  const auto run = manager_->submit(own_->request, own_->check());
  if (!run) return pass(run.error());
  // After the end, serves until clients have received the final state, but at most `to_read`.
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

Status run_daemon(const DaemonOptions& options, const DaemonSignals& signals) {
  // Checked before anything is opened: a service manager must not see a daemon as ready that cannot
  // run anything.
  if (Status rig = check_rig_file(options.rig); !rig) return rig;
  auto daemon = Daemon::open(options);
  if (!daemon) return pass(daemon.error());
  const auto lost = (*daemon)->run(options, signals);
  if (!lost) return {};
  static_cast<void>(daemon->release());
  return fail({.code = Errc::timeout,
               .where = *lost,
               .what = "run unresponsive, the daemon ended without it",
               .hint = "Restart weftd, then check the rig with weft status"});
}

Status run_daemon_for(const DaemonOptions& options, const EmbeddedRun& own) {
  auto daemon = Daemon::open(options, &own);
  if (!daemon) return pass(daemon.error());
  return (*daemon)->run_own();
}

}  // namespace weft::daemon::server
