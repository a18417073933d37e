!> One scene, run for several values of one parameter: a figure of several curves.
module case_runs
   use analyses, only: analyse, analysed_t
   use failures, only: fail, failure_t, status_run_failed
   use kinds, only: wp
   use mesh_choice, only: case_beam_t, find_case_beam
   use motion_run, only: run_motion, set_store_t
   use number_text, only: to_text
   use response_types, only: response_t
   use run_settings, only: run_settings_t
   use scene_beam_model, only: run_of
   use scene_reader, only: draft_t, set_parameters
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
      type(analysed_t), allocatable :: analysed(:)
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

      type(case_beam_t) :: beam
      character(:), allocatable :: problem
      type(set_store_t) :: sets
      type(run_settings_t) :: settings
      type(scene_t), allocatable :: extremes(:)
      ! large
      type(draft_t), allocatable :: draft
      integer :: i

      allocate (draft)
      if (scene%mesh%tolerance > 0.0_wp) then
         allocate (extremes(2), source=scene)
         call set_parameters(extremes(1), [scene%cases%parameter], [minval(scene%cases%values)], problem, &
            draft)
         call set_parameters(extremes(2), [scene%cases%parameter], [maxval(scene%cases%values)], problem, &
            draft)
      end if
      allocate (cases(size(scene%cases%values)))
      do i = 1, size(cases)
         cases(i)%scene = scene
         cases(i)%value = scene%cases%values(i)
         cases(i)%scene%output%measures = .true.
         call set_parameters(cases(i)%scene, [scene%cases%parameter], [cases(i)%value], problem, draft)
         if (allocated(problem)) then
            call fail(error, status_run_failed, trim(scene%cases%parameter%name)//' = '//to_text(cases(i)%value)//': ' &
               //problem)
            return
         end if
         if (allocated(extremes) .and. scene%cases%parameter%is_of_beam) extremes(:) = cases(i)%scene
         call find_case_beam(cases(i)%scene, [cases(i)%value], [scene%cases%parameter%is_of_beam], beam, &
            extremes)
         if (allocated(beam%trouble)) then
            allocate (error, source=beam%trouble)
            return
         end if
         allocate (cases(i)%node_position, source=beam%model%mesh%position)
         settings = run_of(cases(i)%scene)
         call run_motion(beam%model, settings, cases(i)%response, error, beam%modes, sets)
         if (allocated(error)) return
         call analyse(cases(i)%scene, beam%model, settings, cases(i)%response, cases(i)%analysed, error)
         if (allocated(error)) return
         if (beam%check%compared > 0) cases(i)%response%mesh_check = beam%check
      end do
   end subroutine run_cases

end module case_runs
