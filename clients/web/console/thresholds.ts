// From where on a figure is marked, in tables and on the map alike.
export const FEW_PICTURES = 10; // per second; fewer are marked
export const FEW_MOTIONS = 50;
export const LATE_MS = 300; // delay of a picture after what it shows
export const OLD_MS = 250; // age of the newest motion
export const OFF_MS = 5; // how well a clock is known
export const SILENT_S = 3;
export const LOSSY = 0.02; // share of messages that did not come
