// Holds logs and their successors against each other with npm's @mcap/core, as viewers do: through the chunk index
// where there is one, else by reading the whole file.
//
// usage: node independent_reader.js INPUT OUTPUT [INPUT OUTPUT]...      (modules are looked for in NODE_PATH)
//
// Exits with 1 on any message of an input that its output doesn't show the same way, and on any output that doesn't
// show new ones beside them.
const fs = require("fs");
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");

const told = (channel, m) =>
  JSON.stringify([channel?.topic, m.sequence, String(m.logTime), String(m.publishTime), Buffer.from(m.data).toString("hex")]);

function scanned(bytes, decompressHandlers) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const channels = new Map();
  const messages = [];
  reader.append(bytes);
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type === "Message") messages.push(told(channels.get(record.channelId), record));
  }
  return messages;
}

// Messages as a viewer shows them, by which way, and what stopped it.
async function view(path, decompressHandlers) {
  const bytes = fs.readFileSync(path);
  const readable = {
    size: async () => BigInt(bytes.length),
    read: async (offset, size) => {
      if (offset + size > BigInt(bytes.length)) throw new Error("read behind the end");
      return new Uint8Array(bytes.subarray(Number(offset), Number(offset + size)));
    },
  };
  let reader;
  try {
    reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  } catch {
    // not indexed
  }
  if (!reader || reader.chunkIndexes.length === 0 || reader.channelsById.size === 0) {
    return { way: "scan", messages: scanned(bytes, decompressHandlers) };
  }
  const messages = [];
  try {
    for await (const m of reader.readMessages()) messages.push(told(reader.channelsById.get(m.channelId), m));
    for await (const _ of reader.readAttachments()); // throws on a bad one
    for await (const _ of reader.readMetadata());
  } catch (error) {
    return { way: "index", messages, error: error.message };
  }
  return { way: "index", messages };
}

(async () => {
  const decompressHandlers = await loadDecompressHandlers();
  const paths = process.argv.slice(2);
  const ways = {};
  let wrong = 0;
  for (let i = 0; i + 1 < paths.length; i += 2) {
    const [old, fresh] = [await view(paths[i], decompressHandlers), await view(paths[i + 1], decompressHandlers)];
    const left = new Map();
    for (const m of fresh.messages) left.set(m, (left.get(m) ?? 0) + 1);
    const lost = old.messages.filter((m) => !left.get(m) || left.set(m, left.get(m) - 1) === undefined);
    const way = `${old.way} -> ${fresh.way}${old.error ? " (neither can)" : ""}`;
    ways[way] = (ways[way] ?? 0) + 1;
    const stopped = fresh.error && !old.error;
    if (lost.length || stopped || (!old.error && fresh.messages.length <= old.messages.length)) {
      console.log(`${paths[i]}: ${way}: ${lost.length} of ${old.messages.length} lost, ${fresh.messages.length} there, ${fresh.error}`);
      wrong++;
    }
  }
  console.log(JSON.stringify(ways));
  process.exit(wrong ? 1 : 0);
})();
