#include "daemon/service/rpc/event_hub.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

namespace weft::daemon::server {

using nlohmann::json;

struct Event {
  std::uint64_t seq = 0;
  std::int64_t t_us = 0;
  std::string topic;
  json delta;
};

namespace {

bool matches(std::string_view pattern, std::string_view topic) {
  if (pattern.ends_with('*')) return topic.starts_with(pattern.substr(0, pattern.size() - 1));
  return pattern == topic;
}

bool any_matches(const std::vector<std::string>& patterns, std::string_view topic) {
  return std::ranges::any_of(patterns,
                             [&](const std::string& pattern) { return matches(pattern, topic); });
}

/// False if the topic does not fit and is left out.
bool add_snapshot(Opened& opened, std::string_view topic, const json& state) {
  const std::string one = rpc::format_text(topic) + ":" + rpc::format_text(state);
  if (opened.snapshot_json.size() + one.size() > Hub::most_snapshot_bytes) return false;
  if (opened.snapshot_json.size() > 1) opened.snapshot_json += ',';
  opened.snapshot_json += one;
  --opened.left_off;
  return true;
}

std::string params_of(const Event& event, const std::string& subscription, std::uint64_t dropped) {
  return rpc::format_text({{"sub", subscription},
                           {"seq", event.seq},
                           {"t_us", event.t_us},
                           {"topic", event.topic},
                           {"delta", event.delta},
                           {"dropped", dropped}});
}

}  // namespace

Subscription::Subscription(std::string id, SubscriptionRequest request)
    : id_(std::move(id)), request_(std::move(request)) {}
Subscription::~Subscription() = default;

bool Subscription::wants(std::string_view topic) const {
  return any_matches(request_.topics, topic);
}

void Subscription::offer(const std::shared_ptr<const Event>& event) {
  if (request_.mode == Mode::latest) {
    auto& merged = merged_[event->topic];
    if (merged) {
      merged->delta.update(event->delta, true);  // keeps nulls: they mark removed members
      merged->seq = event->seq;
      merged->t_us = event->t_us;
    } else {
      merged = std::make_shared<Event>(*event);
    }
  } else {
    if (waiting_.size() >= most_waiting) {
      waiting_.pop_front();  // the oldest: newer events matter more
      ++dropped_;
    }
    waiting_.push_back(event);
  }
}

Status Subscription::grant(std::uint64_t events) {
  if (!request_.credit)
    return fail({.code = Errc::wrong_state,
                 .where = "/params/sub",
                 .what = "subscription without credit",
                 .expected = "a subscription opened with credit",
                 .got = id_,
                 .hint = "Pass credit to sub.open"});
  *request_.credit = std::min(*request_.credit, most_credit - events) + events;
  return {};
}

std::string Subscription::take(Clock now) {
  if (request_.credit && *request_.credit == 0) return {};
  std::string event = taken(now);
  if (request_.credit && !event.empty()) --*request_.credit;
  return event;
}

std::string Subscription::taken(Clock now) {
  if (request_.mode == Mode::every) {
    if (!replayed_.empty()) {
      const auto event = std::move(replayed_.front());
      replayed_.pop_front();
      return params_of(*event, id_, 0);
    }
    if (waiting_.empty()) return {};
    const auto event = std::move(waiting_.front());
    waiting_.pop_front();
    return params_of(*event, id_, std::exchange(dropped_, 0));
  }
  if (merged_.empty() || now < not_before_) return {};
  // oldest first, so that a busy topic does not delay a quiet one
  const auto oldest =
      std::ranges::min_element(merged_, {}, [](const auto& each) { return each.second->seq; });
  const std::shared_ptr<Event> event = std::move(oldest->second);
  merged_.erase(oldest);
  if (merged_.empty() && request_.max_hz > 0)
    not_before_ = now + std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / request_.max_hz));
  return params_of(*event, id_, 0);
}

void Hub::publish(std::string_view topic, const json& delta, std::int64_t t_us) {
  const auto event = std::make_shared<const Event>(Event{++seq_, t_us, std::string(topic), delta});
  auto& snapshot = snapshots_[event->topic];
  if (!snapshot) snapshot = std::make_unique<json>(json::object());
  snapshot->merge_patch(delta);
  changed_.insert_or_assign(event->topic, seq_);
  recent_.push_back(event);
  if (recent_.size() > most_replayed) {
    forgotten_ = recent_.front()->seq;
    recent_.pop_front();
  }
  offer(event);
}

void Hub::pass_on(std::string_view topic, const json& delta, std::int64_t t_us) {
  offer(std::make_shared<const Event>(Event{++seq_, t_us, std::string(topic), delta}));
}

bool Hub::wanted(std::string_view topic) const {
  return std::any_of(subscriptions_.begin(), subscriptions_.end(), [&](const auto& each) {
    const auto subscription = each.lock();
    return subscription && subscription->wants(topic);
  });
}

void Hub::offer(const std::shared_ptr<const Event>& event) {
  subscriptions_.remove_if([&event](const auto& each) {
    const auto subscription = each.lock();
    if (subscription && subscription->wants(event->topic)) subscription->offer(event);
    return !subscription;
  });
  if (news_) news_();
}

std::shared_ptr<Subscription> Hub::add(const SubscriptionRequest& request) {
  auto made = std::make_shared<Subscription>("u" + std::to_string(next_id_++), request);
  subscriptions_.push_back(made);
  return made;
}

Opened Hub::open(const SubscriptionRequest& request) {
  std::vector<std::pair<std::uint64_t, std::string_view>> newest_first;
  for (const auto& [topic, seq] : changed_)
    if (any_matches(request.topics, topic)) newest_first.emplace_back(seq, topic);
  std::ranges::sort(newest_first, std::greater<>());
  Opened opened{add(request), seq_, "{", newest_first.size()};
  for (const auto& [seq, topic] : newest_first)
    if (!add_snapshot(opened, topic, *snapshots_.find(topic)->second)) break;
  if (archive_.find) open_archived(request, opened);
  opened.snapshot_json += '}';
  return opened;
}

void Hub::open_archived(const SubscriptionRequest& request, Opened& opened) const {
  const auto is_here = [this](const auto& topic) {
    return topic.first.starts_with(archive_.prefix);
  };
  if (any_matches(request.topics, archive_.prefix)) {
    const auto here = static_cast<std::size_t>(std::ranges::count_if(snapshots_, is_here));
    opened.left_off += std::max(archive_.count(), here) - here;
    return;
  }
  const std::set<std::string_view> topics(request.topics.begin(), request.topics.end());
  for (const std::string_view topic : topics) {
    if (snapshots_.contains(topic)) continue;
    const auto found = archive_.find(topic);
    if (!found) continue;
    ++opened.left_off;
    add_snapshot(opened, topic, *found);
  }
}

void Hub::forget(std::string_view topic) {
  if (const auto known = snapshots_.find(topic); known != snapshots_.end()) snapshots_.erase(known);
  if (const auto known = changed_.find(topic); known != changed_.end()) changed_.erase(known);
}

tl::expected<Opened, rpc::RpcError> Hub::replay(const SubscriptionRequest& request,
                                                std::uint64_t from_seq) {
  if (from_seq < forgotten_ || from_seq > seq_) {
    return rpc::refused(rpc::code::state + 40, "replay.gone",
                        {.code = Errc::range,
                         .where = "/params/from_seq",
                         .what = "events no longer kept",
                         .expected = std::to_string(forgotten_) + " to " + std::to_string(seq_),
                         .got = std::to_string(from_seq),
                         .hint = "Omit from_seq to get a snapshot"},
                        true);
  }
  SubscriptionRequest every = request;
  every.mode = Mode::every;
  Opened opened{add(every), seq_, "{}"};
  for (const auto& event : recent_)
    if (event->seq > from_seq && opened.subscription->wants(event->topic))
      opened.subscription->replayed_.push_back(event);
  return opened;
}

std::size_t Hub::listeners() const {
  return static_cast<std::size_t>(std::count_if(subscriptions_.begin(), subscriptions_.end(),
                                                [](const auto& s) { return !s.expired(); }));
}

}  // namespace weft::daemon::server
