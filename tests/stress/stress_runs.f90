!> Runs under stress, and what must hold in each: all finite, no energy won, no stop entered, no stop that pulls, the
!> energy balance closed.
module stress_runs
   use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
   use, intrinsic :: iso_fortran_env, only: output_unit
   use beam_mesh, only: make_mesh, mesh_t
   use beam_model, only: beam_model_t, make_beam_model
   use beam_section, only: tapered_section
   use exact_motion, only: exact_response
   use failures, only: failure_t
   use history_list, only: eta_stop, force_stop, history_count
   use kinds, only: wp
   use response_types, only: response_t
   use run_settings, only: law_restitution, law_three_element, output_settings_t, response_settings_t, &
      run_settings_t, stop_settings_t
   implicit none (type, external)
   private
   public :: beam_for, stressed_t, run_stressed, three_element_stop, say, long_form, height_ratio

   real(wp), parameter :: height_ratio = 0.075_wp

   !> A run, and how far it is from what must hold.
   type :: stressed_t
      type(response_t) :: response
      !> What failed or is not so; empty: all is well
      character(:), allocatable :: complaint
      !> Gap of the energy balance in the energy at the start
      real(wp) :: energy_balance = 0.0_wp
   end type stressed_t

contains

   !> Is the long form asked for, IMPACTBEAM_STRESS=long?
   function long_form() result(is_long)
      logical :: is_long

      character(16) :: text
      integer :: status

      call get_environment_variable('IMPACTBEAM_STRESS', text, status=status)
      is_long = status == 0 .and. text == 'long'
   end function long_form

   !> One line with a figure.
   subroutine say(what, figure)
      !> What it is
      character(*), intent(in) :: what
      !> The figure
      real(wp), intent(in) :: figure

      write (output_unit, '(4x, a, es9.2)') what//': ', figure
   end subroutine say

   !> A tapered beam.
   function beam_for(elements, ratio, taper, tip_mass, position, is_redistributed) result(model)
      !> Mesh
      integer, intent(in) :: elements
      real(wp), intent(in) :: ratio
      !> s, mu
      real(wp), intent(in) :: taper
      real(wp), intent(in) :: tip_mass
      !> Lc/L; absent: the tip
      real(wp), intent(in), optional :: position
      !> Inertia redistributed at the stop; default false
      logical, intent(in), optional :: is_redistributed
      type(beam_model_t) :: model

      type(mesh_t) :: mesh
      type(failure_t), allocatable :: error
      real(wp) :: place

      place = 1.0_wp
      if (present(position)) place = position
      call make_mesh(elements, ratio, place, mesh, error)
      call make_beam_model(tapered_section(1.0_wp + taper, 1.0_wp - taper), mesh, tip_mass, model, is_redistributed)
   end function beam_for

   !> Model B.
   pure function three_element_stop(stiffness, branch, damper, preload) result(stop_settings)
      !> kappa, beta, c*, delta
      real(wp), intent(in) :: stiffness
      real(wp), intent(in) :: branch
      real(wp), intent(in) :: damper
      real(wp), intent(in) :: preload
      type(stop_settings_t) :: stop_settings

      stop_settings%law = law_three_element
      stop_settings%stiffness_ratio = stiffness
      stop_settings%branch_ratio = branch
      stop_settings%damper_ratio = damper
      stop_settings%preload = preload
   end function three_element_stop

   !> Run, and check everything that must hold.
   subroutine run_stressed(model, zeta, stop_settings, settings, stressed)
      !> The beam
      type(beam_model_t), intent(in) :: model
      !> zeta
      real(wp), intent(in) :: zeta
      !> Stop and run
      type(stop_settings_t), intent(in) :: stop_settings
      type(response_settings_t), intent(in) :: settings
      !> What came out
      type(stressed_t), intent(out) :: stressed

      real(wp), parameter :: rounding = 1.0e-9_wp, rounding_of_event = 1.0e-11_wp
      type(output_settings_t) :: output
      type(failure_t), allocatable :: error
      real(wp), allocatable :: total(:)
      real(wp) :: reach, unit
      integer :: i

      stressed%complaint = ''
      output%energy = .true.
      call exact_response(model, run_settings_t(zeta, stop_settings, settings, output, height_ratio), &
         stressed%response, error)
      if (allocated(error)) then
         stressed%complaint = error%message
         return
      end if
      associate (response => stressed%response, e => stressed%response%energy)
         do i = 1, history_count
            if (.not. allocated(response%history(i)%values)) cycle
            if (.not. all(ieee_is_finite(response%history(i)%values))) stressed%complaint = stressed%complaint &
               //' not finite'
         end do
         if (minval(response%history(force_stop)%values) < -rounding*max(1.0_wp, maxval(response%history(force_stop)%values))) &
            stressed%complaint = stressed%complaint//' the stop pulls'
         total = e%kinetic + e%strain + e%stop + e%dissipated_beam + e%dissipated_stop + e%dissipated_impact - e%created
         unit = max(response%initial_energy, tiny(1.0_wp))
         stressed%energy_balance = maxval(abs(total - response%initial_energy))/unit
         ! each event adds the rounding of its own: of a contact with a spring that is 1e12 times the beam's most of all
         if (stressed%energy_balance > rounding + rounding_of_event*real(response%event_count, wp)) &
            stressed%complaint = stressed%complaint//' open ledger'
         total = e%kinetic + e%strain + e%stop
         if (maxval(total) > response%initial_energy + rounding*unit) stressed%complaint = stressed%complaint//' energy won'
         if (maxval(e%created) > 0.0_wp) stressed%complaint = stressed%complaint//' energy created'
         if (stop_settings%law == law_restitution) then
            reach = 1.0_wp + abs(stop_settings%preload)
            if (minval(response%history(eta_stop)%values) < -rounding*reach) &
               stressed%complaint = stressed%complaint//' the beam enters the stop'
            if (response%event_count > 0) then
               if (any(response%events(:response%event_count)%energy_change > 0.0_wp)) &
                  stressed%complaint = stressed%complaint//' an event wins energy'
            end if
         end if
      end associate
   end subroutine run_stressed

end module stress_runs
