#include "experiments/cli/perform/stream_input.h"

#include <unistd.h>

#include <filesystem>

#include "autograd/base/log.h"
#include "datasets/importers/joints/layouts.h"
#include "datasets/readers/clouds/mesh_io.h"
#include "datasets/readers/text/text.h"
#include "experiments/cli/perform/stream_take.h"
#include "experiments/source.h"
#include "infer/live/folder_input.h"

namespace restage::cli {
namespace {

constexpr const char* kTcp = "tcp://";

live::FolderFiles folder_files(uint64_t max_memory) {
  return {[](const std::string& name) {
            return !name.starts_with(".") &&
                   (is_mesh_name(name) || is_cloud_name(name) || may_be_cloud_name(name) ||
                    text::ends_in(name, {".npy", ".npz"}));
          },
          natural_less,
          [max_memory](const std::string& path, live::LiveCloud& into) {
            const auto file = open_frames(path, {.clip = "", .max_memory = max_memory});
            const int64_t before = file->frames() - 1;
            for (int64_t k = 0; k < before; ++k) file->skip();
            std::optional<Frame> frame = file->next();
            if (!frame) throw InputError(path, "holds no cloud", "write one into it");
            if (frame->fault) throw *frame->fault;
            into.left_out = frame->left_out;
            into.points = std::move(frame->points);
            return before;
          }};
}

}  // namespace

bool StreamCommand::folder() const { return in != "-" && !in.starts_with(kTcp); }

StreamPlaces check_stream(const StreamCommand& c) {
  check_options(c.how.options, system_type(c.how.system));
  if (c.seconds && !(*c.seconds > 0 && *c.seconds < 1e9))
    throw InputError("", "--seconds is out of range", "give more than 0 seconds");
  if (!c.how.layout.empty()) joint_layout(c.how.layout);  // or there is none
  StreamPlaces out;
  const auto place = [](const std::string& text, const std::string& option) {
    return live::resolved(live::parse_place(text, option), option);
  };
  if (c.in.starts_with(kTcp))
    out.socket = place(c.in.substr(std::string(kTcp).size()), "--source");
  else if (c.in.find("://") != std::string::npos)
    throw InputError("", "--source '" + c.in.substr(0, 80) + "' is no kind of input",
                     "give a folder, - or tcp://127.0.0.1:PORT");
  else if (c.in != "-" && !std::filesystem::is_directory(c.in))
    throw InputError(
        c.in, std::filesystem::exists(c.in) ? "is no folder" : "there is no such folder",
        "give a folder into which clouds are written, - or tcp://127.0.0.1:PORT; files are for "
        "retarget");
  out.vmc = place(c.vmc, "--vmc");
  if (!c.ws.empty()) out.page = place(c.ws, "--ws");
  check_take(c.how, out.socket || c.in == "-" ? "" : c.in);
  if (out.socket && out.page && out.socket->port == out.page->port &&
      out.socket->host == out.page->host)
    throw InputError("", "--source and --ws name the same port", "give two");
  return out;
}

std::unique_ptr<live::CloudInput> open_input(const StreamCommand& c, const StreamPlaces& places,
                                             uint64_t max_memory) {
  if (places.socket)
    return std::make_unique<live::SocketInput>(
        std::make_unique<live::Listener>(*places.socket, "--source"));
  if (c.in == "-") return std::make_unique<live::PipeInput>(STDIN_FILENO, "standard input");
  return std::make_unique<live::FolderInput>(c.in, folder_files(max_memory));
}

void say_places(const StreamCommand& c, const StreamPlaces& places) {
  log_info("frames (clouds or joints) come from " +
           (places.socket ? kTcp + places.socket->text()
            : c.in == "-" ? std::string("standard input")
                          : c.in) +
           "; poses go to " + places.vmc.text() + " (VMC)");
  if (places.page) log_info("the page is http://" + places.page->text() + "/");
  for (const auto& [place, what] :
       {std::pair(places.socket, "send frames"), {places.page, "see the page"}})
    if (place && !place->loopback())
      log_warning("whoever reaches " + place->text() + " from another machine can " + what);
}

}  // namespace restage::cli
