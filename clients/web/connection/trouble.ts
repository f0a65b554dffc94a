// What the connection says where nothing comes. It knows no languages: a worker cannot ask which was chosen.
export const TROUBLE = {
  again: "Nothing comes; trying again.",
  over: "The conference has ended. This page waits for the next one.",
};
