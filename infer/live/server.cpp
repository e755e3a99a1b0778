#include "infer/live/server.h"

#include <unistd.h>

#include <libwebsockets.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <mutex>
#include <thread>
#include <vector>

#include "autograd/base/error.h"

namespace restage::live {
namespace {

constexpr size_t kPiece = 1 << 15;  // bytes of the page that are written at once

/// Who says nothing for ten seconds is asked whether anybody is there, and hung up ten seconds
/// later.
constexpr lws_retry_bo_t kIdle{nullptr, 0, 0, 10, 20, 0};

/// What we remember of a connection; libwebsockets makes it, all zero.
struct Client {
  size_t page_at;  ///< bytes of the page that were sent
  int64_t frame;   ///< number of the last frame that was sent
};

std::string header(lws* wsi, lws_token_indexes which) {
  std::string out(static_cast<size_t>(std::max(0, lws_hdr_total_length(wsi, which))) + 1, '\0');
  out.resize(static_cast<size_t>(
      std::max(0, lws_hdr_copy(wsi, out.data(), static_cast<int>(out.size()), which))));
  return out;
}

}  // namespace

struct PageServer::State {
  std::string page, host;
  lws_context* context = nullptr;
  std::thread thread;
  std::atomic<bool> ending{false};
  std::mutex mutex;
  std::vector<unsigned char> frame;  ///< the newest, behind LWS_PRE bytes of room; under the mutex
  int64_t number = 0;                ///< of the newest frame, from 1; under the mutex
  std::vector<unsigned char> out;    ///< what is being written

  /// Pages elsewhere must not read the stream through a visitor's browser, under whatever name
  /// they call this machine.
  bool welcome(lws* wsi) const {
    const std::string from = header(wsi, WSI_TOKEN_ORIGIN), asked = header(wsi, WSI_TOKEN_HOST);
    return from.empty() || (is_ours(asked) && from == "http://" + asked);
  }
  /// Whether a browser that calls us so has been told of us, not of somebody who borrows our
  /// address: an address, or this machine's own name.
  bool is_ours(const std::string& asked) const {
    if (asked.starts_with('[')) return asked.find(']') != std::string::npos;
    const std::string name = asked.substr(0, asked.find(':'));
    char machine[256] = "";
    gethostname(machine, sizeof machine - 1);
    return name == "localhost" || name == host || (name == machine && !name.empty()) ||
           (!name.empty() && name.find_first_not_of("0123456789.") == std::string::npos);
  }
  /// Answers with a status alone.
  static int refuse(lws* wsi, unsigned status) {
    if (lws_return_http_status(wsi, status, nullptr) != 0) return -1;
    return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
  }
  int begin_page(lws* wsi, const char* path);
  int send_page(lws* wsi, Client& client);
  int send_frame(lws* wsi, Client& client);
  static int answer(lws* wsi, lws_callback_reasons why, void* user, void* in, size_t size);
};

int PageServer::State::begin_page(lws* wsi, const char* path) {
  if (lws_hdr_total_length(wsi, WSI_TOKEN_GET_URI) == 0)
    return refuse(wsi, HTTP_STATUS_METHOD_NOT_ALLOWED);
  if (const std::string asked = header(wsi, WSI_TOKEN_HOST); !asked.empty() && !is_ours(asked))
    return refuse(wsi, HTTP_STATUS_FORBIDDEN);
  if (std::strcmp(path, "/") != 0) return refuse(wsi, HTTP_STATUS_NOT_FOUND);
  unsigned char room[LWS_PRE + 2048], *at = room + LWS_PRE, *const end = room + sizeof room;
  unsigned char* const start = at;
  if (lws_add_http_common_headers(wsi, HTTP_STATUS_OK, "text/html; charset=utf-8", page.size(), &at,
                                  end) != 0 ||
      lws_finalize_write_http_header(wsi, start, &at, end) != 0)
    return -1;
  lws_callback_on_writable(wsi);
  return 0;
}

int PageServer::State::send_page(lws* wsi, Client& client) {
  const size_t count = std::min(kPiece, page.size() - client.page_at);
  out.assign(LWS_PRE, 0);
  out.insert(out.end(), page.begin() + static_cast<std::ptrdiff_t>(client.page_at),
             page.begin() + static_cast<std::ptrdiff_t>(client.page_at + count));
  client.page_at += count;
  const bool last = client.page_at == page.size();
  if (lws_write(wsi, out.data() + LWS_PRE, count, last ? LWS_WRITE_HTTP_FINAL : LWS_WRITE_HTTP) <
      static_cast<int>(count))
    return -1;
  if (!last) {
    lws_callback_on_writable(wsi);
    return 0;
  }
  client.page_at = 0;
  return lws_http_transaction_completed(wsi) != 0 ? -1 : 0;
}

int PageServer::State::send_frame(lws* wsi, Client& client) {
  {
    const std::lock_guard lock(mutex);
    if (client.frame == number) return 0;
    client.frame = number;
    out = frame;
  }
  const size_t size = out.size() - LWS_PRE;
  return lws_write(wsi, out.data() + LWS_PRE, size, LWS_WRITE_BINARY) < static_cast<int>(size) ? -1
                                                                                               : 0;
}

int PageServer::State::answer(lws* wsi, lws_callback_reasons why, void* user, void* in, size_t) {
  if (wsi == nullptr) return 0;
  lws_context* const context = lws_get_context(wsi);
  auto* const state = static_cast<State*>(lws_context_user(context));
  auto* const client = static_cast<Client*>(user);
  switch (why) {
    case LWS_CALLBACK_HTTP:
      return state->begin_page(wsi, static_cast<const char*>(in));
    case LWS_CALLBACK_HTTP_WRITEABLE:
      return state->send_page(wsi, *client);
    case LWS_CALLBACK_FILTER_PROTOCOL_CONNECTION:
      return state->welcome(wsi) ? 0 : -1;
    case LWS_CALLBACK_ESTABLISHED:
      client->frame = 0;
      lws_callback_on_writable(wsi);
      return 0;
    case LWS_CALLBACK_SERVER_WRITEABLE:
      return state->send_frame(wsi, *client);
    case LWS_CALLBACK_EVENT_WAIT_CANCELLED:
      lws_callback_on_writable_all_protocol(context, lws_get_protocol(wsi));
      return 0;
    case LWS_CALLBACK_RECEIVE:  // nobody has anything to tell us
      return 0;
    default:
      return lws_callback_http_dummy(wsi, why, user, in, 0);
  }
}

std::string frame_message(double seconds, double confidence, const Points& vertices) {
  const auto sure = static_cast<float>(confidence);
  const auto count = static_cast<uint32_t>(vertices.size());
  static_assert(sizeof(Point) == 12);
  std::string out(16 + sizeof(Point) * vertices.size(), '\0');
  std::memcpy(out.data(), &seconds, 8);
  std::memcpy(out.data() + 8, &sure, 4);
  std::memcpy(out.data() + 12, &count, 4);
  if (count > 0) std::memcpy(out.data() + 16, vertices.data(), sizeof(Point) * vertices.size());
  return out;
}

PageServer::PageServer(const Place& where, const std::string& option, std::string page)
    : state_(std::make_unique<State>()) {
  { const Listener free(where, option); }  // says in our words why the port cannot be had
  state_->page = std::move(page);
  state_->host = where.host;
  static const lws_protocols kProtocols[] = {
      {"restage", State::answer, sizeof(Client), 0, 0, nullptr, 0},
      {nullptr, nullptr, 0, 0, 0, nullptr, 0}};
  lws_set_log_level(0, nullptr);
  lws_context_creation_info info{};
  const bool v6 = where.host.find(':') != std::string::npos;
  info.port = where.port;
  info.iface = where.host == "0.0.0.0" || where.host == "::" ? nullptr : where.host.c_str();
  info.protocols = kProtocols;
  info.user = state_.get();
  info.gid = info.uid = static_cast<decltype(info.gid)>(-1);
  info.options =
      LWS_SERVER_OPTION_FAIL_UPON_UNABLE_TO_BIND | (v6 ? 0 : LWS_SERVER_OPTION_DISABLE_IPV6);
  info.fd_limit_per_thread = 256;
  info.retry_and_idle_policy = &kIdle;
  state_->context = lws_create_context(&info);
  if (state_->context == nullptr)
    throw InputError("", option + " cannot listen on " + where.text(), "give another port");
  state_->thread = std::thread([state = state_.get()] {
    while (!state->ending && lws_service(state->context, 0) >= 0) continue;
  });
}

PageServer::~PageServer() {
  state_->ending = true;
  lws_cancel_service(state_->context);
  state_->thread.join();
  lws_context_destroy(state_->context);
}

void PageServer::send(std::string message) {
  {
    const std::lock_guard lock(state_->mutex);
    state_->frame.resize(LWS_PRE + message.size());
    std::memcpy(state_->frame.data() + LWS_PRE, message.data(), message.size());
    ++state_->number;
  }
  lws_cancel_service(state_->context);
}

}  // namespace restage::live
