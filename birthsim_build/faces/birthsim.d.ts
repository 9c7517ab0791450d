import { INDEX, ROW, ROWS, RowName } from "./layout.js";

export { INDEX, ROW, ROWS, RowName };

/** Code and data as bytes, where they do not lie beside the module. */
export interface Given {
  code: BufferSource;
  data: ArrayBuffer | ArrayBufferView;
}

export interface Choice {
  /** A key of INDEX.scenarios. */
  scenario: string;
  /** A key of INDEX.sensors; default: ideal. */
  sensors?: string;
  /** A key of INDEX.controllers. */
  controller: string;
  valves?: "two_valves" | "one_valve";
}

export function load(from?: string | URL | Given): Promise<Bundle>;

export class Bundle {
  /** Control period, s. */
  readonly period: number;
  /** A closed loop where an episode begins. */
  loop(choice: Choice): Loop;
  /** The plant alone: openings and force in, state out. */
  plant(): Loop;
  /** A law alone: measurements and reference in, openings out. */
  controller(controller: string, sensors?: string): Loop;
  /** The number of the part that is a controller's law, for Loop.exchange. */
  law(controller: string, sensors?: string): number;
}

export class Loop {
  /** All rows, SI units; their numbers are in ROW. Take it anew after exchange(). */
  readonly rows: Float64Array;
  /** Run control periods, of the parts `only` where they are named; returns how many times a law could not serve its setpoint. */
  advance(periods?: number, only?: readonly string[] | null): number;
  /** Value of a row. */
  get(name: RowName): number;
  /** Set a row: an input, a parameter of the rig, an opening or a force. */
  set(name: RowName, value: number): void;
  /** Where an episode begins, with the parts that the loop was made with. */
  reset(): void;
  /** Exchange a part (a name of INDEX.order) for another (a number of INDEX.parts), or for none, while the rig keeps its state. */
  exchange(name: string, number?: number): void;
  /** What the first stage of a part remembers. */
  memory(name: string): Float64Array;
  /** The k-th table of a part, as an array of its kind. */
  table<T>(name: string, k: number, Kind: new (buffer: ArrayBufferLike, from: number, size: number) => T): T;
}
