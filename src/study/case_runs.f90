!> One scene, run for several values of one parameter: a figure of several curves.
module case_runs
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use motion_run, only: find_shared_modes, run_motion
   use response_types, only: response_t
   use scene_beam_model, only: model_of, run_of
   use scene_parameters, only: set_parameter
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: case_t, run_cases

   type :: case_t
      !> The scene with the case's value
      type(scene_t) :: scene
      real(wp) :: value = 0.0_wp
      !> x/L of the nodes, [0:n]
      real(wp), allocatable :: node_position(:)
      type(response_t) :: response
   end type case_t

contains

   !> Run all cases of a scene. Cases of one beam share its modes.
   subroutine run_cases(scene, cases, error)
      !> The scene; it has &cases
      type(scene_t), intent(in) :: scene
      !> The cases, in the order of the values
      type(case_t), allocatable, intent(out) :: cases(:)
      !> Set when a run fails
      type(failure_t), allocatable, intent(out) :: error

      type(beam_model_t) :: model
      type(free_modes_t) :: modes
      integer :: i

      allocate (cases(size(scene%cases%values)))
      do i = 1, size(cases)
         cases(i)%scene = scene
         cases(i)%value = scene%cases%values(i)
         cases(i)%scene%output%measures = .true.
         call set_parameter(cases(i)%scene, scene%cases%parameter, cases(i)%value)
         if (i == 1 .or. scene%cases%parameter%is_of_beam) call make_beam(cases(i)%scene, model, modes, error)
         if (allocated(error)) return
         allocate (cases(i)%node_position, source=model%mesh%position)
         call run_motion(model, run_of(cases(i)%scene), cases(i)%response, error, modes)
         if (allocated(error)) return
      end do
   end subroutine run_cases

   !> The beam of a case and what its runs share.
   subroutine make_beam(scene, model, modes, error)
      !> The scene of the case
      type(scene_t), intent(in) :: scene
      !> The assembled beam
      type(beam_model_t), intent(out) :: model
      !> Its modes
      type(free_modes_t), intent(out) :: modes
      !> Set when they cannot be found
      type(failure_t), allocatable, intent(out) :: error

      call model_of(scene, scene%mesh%elements, scene%mesh%ratio, model, error)
      if (allocated(error)) return
      call find_shared_modes(model, run_of(scene), modes, error)
   end subroutine make_beam

end module case_runs
