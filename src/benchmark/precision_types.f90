!> What a study of run time against error finds.
module precision_types
   use kinds, only: i8, wp
   use motion_errors, only: motion_errors_t
   use run_settings, only: name_length
   use scene_types, only: mass_consistent
   use timed_tasks, only: timing_t
   implicit none (type, external)
   private
   public :: motion_entry_t, timed_part_t, curve_t, solver_entry_t, check_t, saving_t, precision_t, beam_t
   public :: varied_step, varied_hop, varied_modes, varied_mesh, varied_names

   !> What an entry differs in from its neighbours.
   integer, parameter :: varied_step = 1
   integer, parameter :: varied_hop = 2
   integer, parameter :: varied_modes = 3
   integer, parameter :: varied_mesh = 4
   character(*), parameter :: varied_names(4) = [character(name_length) :: &
      'step', 'hop_tolerance', 'mode_tolerance', 'mesh_elements']

   !> Longest reason of a failure that is kept.
   integer, parameter :: failure_length = 256

   !> One way through one scene.
   type :: motion_entry_t
      !> One of the `contender_` constants, and of the `varied_` ones
      integer :: contender = 0
      integer :: varied = 0
      !> Newmark's step; tolerances of `exact`; mesh
      real(wp) :: step = 0.0_wp
      real(wp) :: hop_tolerance = 0.0_wp
      real(wp) :: mode_tolerance = 0.0_wp
      integer :: elements = 0
      !> One of the `mass_` constants
      integer :: mass = mass_consistent
      !> A whole run from the assembled beam, events only; and without what runs of one beam share
      type(timing_t) :: whole
      type(timing_t) :: motion
      !> Against the reference
      type(motion_errors_t) :: errors
      integer :: event_count = 0
      integer :: modes_kept = 0
      integer(i8) :: evaluations = 0_i8
      !> Why there is nothing; empty: there is
      character(failure_length) :: failure = ''
   end type motion_entry_t

   !> A part of a run, and the seconds it takes.
   type :: timed_part_t
      character(name_length) :: name = ''
      type(timing_t) :: timing
   end type timed_part_t

   !> How something grows.
   type :: curve_t
      !> What grows, with what, and its unit
      character(name_length) :: name = ''
      character(name_length) :: abscissa_name = ''
      character(name_length) :: unit = ''
      real(wp), allocatable :: abscissa(:)
      real(wp), allocatable :: ordinate(:)
      !> Fitted to the upper half: ordinate ~ abscissa^exponent
      real(wp) :: exponent = 0.0_wp
   end type curve_t

   !> One eigen-solver on one mesh.
   type :: solver_entry_t
      character(name_length) :: solver = ''
      integer :: elements = 0
      real(wp) :: ratio = 1.0_wp
      type(timing_t) :: timing
      !> |lambda/exact - 1| of the first mode and the largest of all asked for; negative: not known
      real(wp) :: first_error = -1.0_wp
      real(wp) :: largest_error = -1.0_wp
   end type solver_entry_t

   !> The reference against Newmark's steps 1/4 extrapolated to none.
   type :: check_t
      !> The two steps
      real(wp) :: steps(2) = 0.0_wp
      !> How far the longer step is from the extrapolation, and the extrapolation from the reference
      type(motion_errors_t) :: between_steps
      type(motion_errors_t) :: difference
      !> Why there is none; empty: there is
      character(failure_length) :: failure = ''
   end type check_t

   !> What is skipped where a scene does not need it.
   type :: saving_t
      character(name_length) :: name = ''
      !> The same thing done without the skip and with it
      type(timing_t) :: without
      type(timing_t) :: with
      !> Greatest difference of the two answers, and of what; negative: there is none to compare
      real(wp) :: difference = -1.0_wp
      character(name_length) :: compared = ''
   end type saving_t

   !> The run that stands for the beam itself, and how far from it are what should meet it.
   type :: beam_t
      integer :: elements = 0
      !> One of the `mass_` constants
      integer :: mass = mass_consistent
      !> The same on half the elements; with the other mass matrix, extrapolated where that is of the first order
      type(motion_errors_t) :: half
      type(motion_errors_t) :: other
      !> Why there is no other; empty: there is
      character(failure_length) :: no_other = ''
      !> What is left of an error of the fourth order when the elements are halved: how well it knows eta
      real(wp) :: uncertainty = 0.0_wp
   end type beam_t

   type :: precision_t
      type(motion_entry_t), allocatable :: motion(:)
      type(check_t) :: check
      !> Unallocated: not asked for
      type(beam_t), allocatable :: beam
      !> Up to here histories are compared: the peak of the third rebound, or the end of the run
      real(wp) :: horizon = 0.0_wp
      type(timed_part_t), allocatable :: parts(:)
      type(curve_t), allocatable :: curves(:)
      type(solver_entry_t), allocatable :: solvers(:)
      type(saving_t), allocatable :: savings(:)
   end type precision_t

end module precision_types
