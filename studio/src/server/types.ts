/** What a job may be asked. Written by tools/write_types.py; do not change it here. */

export type JobRequest =
  GenerateRequest | ComposeRequest | ControlRequest | EditRequest | PredictRequest | SwitchRequest | DuetRequest;

export interface GenerateRequest {
  readonly task: "generate";
  /** send the poses as events after so many network calls, or after every one */
  readonly levels?: boolean | number;
  /** what the person does, such as 'a person walks' */
  readonly prompt: string;
  /** length of each motion: as long as its actions take people; what can go on, such as walking, 5, in seconds */
  readonly seconds?: number;
  /** one motion of the whole sentence, 'A, then B' too; numbers are not read */
  readonly as_one?: boolean;
  /** the words as they are: '3 meters' is no goal, and what is missing is not generated again */
  readonly literal?: boolean;
  /** the first motion's seed, the next have the next */
  readonly seed?: number;
  /** motions to make */
  readonly count?: number;
  /** strength of the text: 0 ignores it */
  readonly guidance?: number;
  /** network calls per motion: fewer is faster */
  readonly steps?: number;
  /** of each motion begin so many and keep the one that does most of what its words allow to check */
  readonly best_of?: number;
  readonly solver?: Solver;
  /** what 'motionloom teach' made: FILE for sentences like what it was taught, FILE:FACTOR for all */
  readonly adapter?: readonly string[];
  /** make the end meet the beginning */
  readonly loop?: boolean;
  /** seconds drawn anew for a loop */
  readonly blend?: number;
  /** keep planted feet still, and feet above the floor */
  readonly foot_lock?: boolean;
}

export interface ComposeRequest {
  readonly task: "compose";
  /** send the poses as events after so many network calls, or after every one */
  readonly levels?: boolean | number;
  /** what a timeline file holds */
  readonly timeline: Timeline;
  /** a motion of an earlier timeline; blocks that ask for the same keep its frames */
  readonly kept_from?: string;
  /** the same seed makes the same motion: 0, or the timeline's */
  readonly seed?: number;
  /** strength of the text where a segment has none of its own: 2.5 */
  readonly guidance?: number;
  /** the first motion, though it does not show what the words say plainly */
  readonly literal?: boolean;
  /** motions to make */
  readonly count?: number;
  /** network calls per motion: fewer is faster */
  readonly steps?: number;
  /** of each motion begin so many and keep the one that does most of what its words allow to check */
  readonly best_of?: number;
  /** what 'motionloom teach' made: FILE for sentences like what it was taught, FILE:FACTOR for all */
  readonly adapter?: readonly string[];
  /** make the end meet the beginning */
  readonly loop?: boolean;
  /** seconds drawn anew for a loop */
  readonly blend?: number;
  /** keep planted feet still, and feet above the floor */
  readonly foot_lock?: boolean;
}

export interface ControlRequest {
  readonly task: "control";
  /** send the poses as events after so many network calls, or after every one */
  readonly levels?: boolean | number;
  /** what the person does, such as 'a person walks' */
  readonly prompt?: string;
  /** what a goal file holds */
  readonly goals: Goals;
  /** what a timeline file holds, instead of a prompt; the goals have a path then */
  readonly timeline?: Timeline;
  /** length of each motion: 5, or that of the motion that is followed, in seconds */
  readonly seconds?: number;
  /** bend what was sampled, so that it meets its goals */
  readonly fit?: boolean;
  /** the first motion's seed, the next have the next */
  readonly seed?: number;
  /** motions to make */
  readonly count?: number;
  /** strength of the text: 0 ignores it */
  readonly guidance?: number;
  /** network calls per motion: fewer is faster */
  readonly steps?: number;
  /** of each motion begin so many and keep the one that does most of what its words allow to check */
  readonly best_of?: number;
  /** what 'motionloom teach' made: FILE for sentences like what it was taught, FILE:FACTOR for all */
  readonly adapter?: readonly string[];
  /** make the end meet the beginning */
  readonly loop?: boolean;
  /** seconds drawn anew for a loop */
  readonly blend?: number;
  /** keep planted feet still, and feet above the floor */
  readonly foot_lock?: boolean;
}

export interface EditRequest {
  readonly task: "edit";
  /** send the poses as events after so many network calls, or after every one */
  readonly levels?: boolean | number;
  /** the clip */
  readonly motion: string;
  /** what the person is to do, such as 'waves' */
  readonly prompt?: string;
  /** change only these seconds */
  readonly between?: readonly (readonly [number, number])[];
  /** part that stays: a joint, a group such as lower_body, root */
  readonly keep?: readonly string[];
  /** go on behind the clip, in seconds */
  readonly extend?: number;
  /** how far from the clip: 1 is from noise alone */
  readonly strength?: number;
  /** whom to change, of several people in one motion, counted from 0 */
  readonly person?: number;
  /** a clip whose beginning the parts that do not stay follow, instead of words */
  readonly source?: string;
  /** turn the head to this place: x, y, z, in metres */
  readonly look?: readonly [number, number, number];
  /** even out what is quicker than this, in the parts that do not stay, in seconds */
  readonly smooth?: number;
  /** turn the head to this person's, counted from 0 */
  readonly look_at?: number;
  /** the first motion's seed, the next have the next */
  readonly seed?: number;
  /** motions to make */
  readonly count?: number;
  /** strength of the text: 0 ignores it */
  readonly guidance?: number;
  /** network calls per motion: fewer is faster */
  readonly steps?: number;
  /** of each motion begin so many and keep the one that does most of what its words allow to check */
  readonly best_of?: number;
  /** what 'motionloom teach' made: FILE for sentences like what it was taught, FILE:FACTOR for all */
  readonly adapter?: readonly string[];
  /** make the end meet the beginning */
  readonly loop?: boolean;
  /** seconds drawn anew for a loop */
  readonly blend?: number;
  /** keep planted feet still, and feet above the floor */
  readonly foot_lock?: boolean;
}

export interface PredictRequest {
  readonly task: "predict";
  /** send the poses as events after so many network calls, or after every one */
  readonly levels?: boolean | number;
  /** how far to predict, in seconds */
  readonly seconds?: number;
  /** who goes on, of several people in one motion, counted from 0 */
  readonly person?: number;
  /** let the person leave the place, which is not as published */
  readonly root?: boolean;
  /** the first motion's seed, the next have the next */
  readonly seed?: number;
  /** motions to make */
  readonly count?: number;
  /** strength of what is known */
  readonly guidance?: number;
  /** network calls per motion: fewer is faster */
  readonly steps?: number;
  /** of each motion begin so many and keep the one that does most of what its words allow to check */
  readonly best_of?: number;
  /** livelier and more varied above 1, calmer below */
  readonly temperature?: number;
  /** make the end meet the beginning */
  readonly loop?: boolean;
  /** seconds drawn anew for a loop */
  readonly blend?: number;
  /** keep planted feet still, and feet above the floor */
  readonly foot_lock?: boolean;
  /** what is gone on from */
  readonly motion: string;
  /** begin at this second of it, in seconds */
  readonly start?: number;
  /** end at this second of it, in seconds */
  readonly end?: number;
}

export interface SwitchRequest {
  readonly task: "switch";
  /** send the poses as events after so many network calls, or after every one */
  readonly levels?: boolean | number;
  /** what is led into */
  readonly target: string;
  /** length of the transition, in seconds */
  readonly seconds?: number;
  readonly facing?: Facing;
  /** the first motion's seed, the next have the next */
  readonly seed?: number;
  /** motions to make */
  readonly count?: number;
  /** strength of what is known */
  readonly guidance?: number;
  /** network calls per motion: fewer is faster */
  readonly steps?: number;
  /** of each motion begin so many and keep the one that does most of what its words allow to check */
  readonly best_of?: number;
  /** livelier and more varied above 1, calmer below */
  readonly temperature?: number;
  /** make the end meet the beginning */
  readonly loop?: boolean;
  /** seconds drawn anew for a loop */
  readonly blend?: number;
  /** keep planted feet still, and feet above the floor */
  readonly foot_lock?: boolean;
  /** what is gone on from */
  readonly motion: string;
  /** begin at this second of it, in seconds */
  readonly start?: number;
  /** end at this second of it, in seconds */
  readonly end?: number;
}

export interface DuetRequest {
  readonly task: "duet";
  /** send the poses as events after so many network calls, or after every one */
  readonly levels?: boolean | number;
  /** what the two do; 'what the first does :: what the second does' */
  readonly prompt?: string;
  /** what a timeline file holds */
  readonly timeline?: Timeline;
  /** a motion of two people that both go on from */
  readonly past?: string;
  /** a motion of the first person, whom the second answers */
  readonly react_to?: string;
  /** what a goal file holds, for one of the two */
  readonly goals?: Goals;
  /** the same for the other of the two; with words or a timeline, and goals */
  readonly other_goals?: Goals;
  /** whose the goals are, counted from 0 */
  readonly person?: number;
  /** length: 6, or what a past gets: 3, in seconds */
  readonly seconds?: number;
  /** the same seed makes the same duets: 0, or the timeline's */
  readonly seed?: number;
  /** strength of the text: 2.5, or the timeline's */
  readonly guidance?: number;
  /** motions to make */
  readonly count?: number;
  /** network calls per motion: fewer is faster */
  readonly steps?: number;
  /** of each motion begin so many and keep the one that does most of what its words allow to check */
  readonly best_of?: number;
  /** how firmly two people keep to where the block wants them: 0 lets them drift apart, as published */
  readonly pair_guidance?: number;
  /** keep bodies out of each other, and bring hands together that the words say meet */
  readonly bodies?: boolean;
  /** what 'motionloom teach' made: FILE for sentences like what it was taught, FILE:FACTOR for all */
  readonly adapter?: readonly string[];
  /** make the end meet the beginning */
  readonly loop?: boolean;
  /** seconds drawn anew for a loop */
  readonly blend?: number;
  /** keep planted feet still, and feet above the floor */
  readonly foot_lock?: boolean;
}

export interface Timeline {
  /** what the person does, one after the other */
  readonly segments: readonly (string | Segment)[];
  /** the same seed makes the same motion */
  readonly seed?: number;
  /** strength of the text: 0 ignores it */
  readonly guidance?: number;
  /** seconds that two neighbours share; without it 1, or what fits */
  readonly transition?: number;
  /** a motion that is gone on from */
  readonly start?: string;
  /** goals of the whole, in the world */
  readonly path?: Goals | string;
  readonly [key: string]: unknown;
}

export interface Segment {
  /** what the person does, such as 'a person walks' */
  readonly text: string;
  /** length of each segment, in seconds */
  readonly seconds?: number;
  /** strength of the text: 0 ignores it */
  readonly guidance?: number;
  /** seconds that two neighbours share; without it 1, or what fits */
  readonly transition?: number;
  /** goals of this segment, seen from where the person is when it begins */
  readonly goal?: Goals | string;
  /** several of them */
  readonly goals?: readonly (Goals | string)[];
  readonly [key: string]: unknown;
}

/** what a goal file holds (docs/control.md) */
export type Goals = { readonly [key: string]: unknown };

export type Solver = "ddpm" | "ddim" | "dpm2m" | "dpm2m-sde";

export type Facing = "turned" | "kept";

export type Root = "motion" | "hips" | "in-place";

export type Hands = "relaxed" | "fist" | "flat" | "as-is";

export type At = "character" | "origin";
